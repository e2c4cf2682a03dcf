// packet_rays.h: sixteen segments as Embree takes them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/level/embree_scene.h"
#include "runtime/occlusion/path_segment.h"

namespace clamor {

struct PacketRays {
  // Casts the segments whose bit is set in `lanes`.
  PacketRays(std::span<const PathSegment, kPacketRays> segments, std::uint32_t lanes) {
    for (std::size_t l = 0; l < kPacketRays; ++l) {
      valid[l] = (lanes >> l & 1) != 0 ? -1 : 0;
      const PathSegment& segment = segments[l];
      rays.ray.org_x[l] = segment.from_m.x;
      rays.ray.org_y[l] = segment.from_m.y;
      rays.ray.org_z[l] = segment.from_m.z;
      rays.ray.tnear[l] = 0;
      rays.ray.dir_x[l] = segment.to_m.x - segment.from_m.x;
      rays.ray.dir_y[l] = segment.to_m.y - segment.from_m.y;
      rays.ray.dir_z[l] = segment.to_m.z - segment.from_m.z;
      rays.ray.time[l] = 0;
      rays.ray.tfar[l] = 1;
      rays.ray.mask[l] = 0xffffffff;
      rays.ray.id[l] = 0;
      rays.ray.flags[l] = 0;
      rays.hit.geomID[l] = rays.hit.primID[l] = rays.hit.instID[0][l] = RTC_INVALID_GEOMETRY_ID;
    }
  }

  bool has_hit(std::size_t lane) const {
    return valid[lane] != 0 && rays.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
  }

  alignas(64) std::array<int, kPacketRays> valid{};
  alignas(64) RTCRayHit16 rays;
};

}  // namespace clamor
