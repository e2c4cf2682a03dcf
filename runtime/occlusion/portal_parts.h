// portal_parts.h: how far movable parts close the portals that they belong to.
//
// The openness of a portal is the share of the power of a diffuse field that gets through it. Lines
// cross the rectangle evenly, in directions by the cosine law, and are followed to both sides. One
// that meets a part of the portal is reflected by it and by the walls near by. If it comes back to
// the other side of the portal's plane, or is caught, it does not get through, except for what the
// parts on the straight line transmit (the mean of its bands in decibels, because a portal has no
// bands). So a leaf that slides or is lifted opens the portal by as much as it uncovers, and one
// that turns by about the width of the gap: it has let everything through long before it stands at
// a right angle.
//
// Threads: the sampler's alone.   Cost: 0.1 ms for each portal of a part that has moved.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/level/portal.h"
#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/part_scene.h"

namespace clamor {

// The openness of a portal, 0 to 1, with its parts in these slots as they stand.
double openness_of(const Portal& portal, std::span<const std::uint32_t> slots,
                   const OcclusionGeometry& geometry, const PartScene& scene);

class PortalParts {
 public:
  PortalParts() = default;
  // `level_parts` are the handles of the level's parts, by their index.
  PortalParts(std::span<const Portal> portals, std::span<const PartHandle> level_parts);

  // Returns whether any portal has been opened or closed by its parts.
  bool update(const OcclusionGeometry& geometry, const PartScene& scene);

  // By portal; 1 where it has no part.
  std::span<const float> openness() const { return openness_; }

 private:
  struct Coupled {
    Portal portal;
    std::size_t index = 0;
    std::vector<std::uint32_t> slots;
    std::uint64_t version = 0;  // of its parts
  };
  std::vector<Coupled> coupled_;
  std::vector<float> openness_;
};

}  // namespace clamor
