// bare_embree.h: the time of Embree alone for a list of rays.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <vector>

#include "bake/trace/scene.h"
#include "common/cpu_time.h"
#include "formats/level/embree_scene.h"

namespace clamor::testing {

// Traces in its own Embree scene, so that no code of ours is timed with Embree.
class BareEmbree {
 public:
  explicit BareEmbree(const Mesh& mesh) {
    device_ = rtcNewDevice(embree_device());
    scene_ = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.vertices_m.size()));
    std::copy(mesh.vertices_m.begin(), mesh.vertices_m.end(), vertices);
    auto* indices = static_cast<std::array<std::uint32_t, 3>*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size()));
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), indices);
    rtcSetGeometryMask(geometry, 0xffffffff);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~BareEmbree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }

  double seconds(const std::vector<Ray>& rays) const {
    const double start = thread_time_s();
    std::uint64_t hits = 0;
    for (const Ray& from : rays) {
      RTCRayHit ray;
      ray.ray.org_x = from.origin_m.x;
      ray.ray.org_y = from.origin_m.y;
      ray.ray.org_z = from.origin_m.z;
      ray.ray.tnear = 0;
      ray.ray.dir_x = from.direction.x;
      ray.ray.dir_y = from.direction.y;
      ray.ray.dir_z = from.direction.z;
      ray.ray.time = 0;
      ray.ray.tfar = std::numeric_limits<float>::infinity();
      ray.ray.mask = 0xffffffff;
      ray.ray.flags = 0;
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
      rtcIntersect1(scene_, &ray);
#else
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      rtcIntersect1(scene_, &context, &ray);
#endif
      hits += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
    }
    const double spent = thread_time_s() - start;
    if (hits == 0) std::abort();
    return spent;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace clamor::testing
