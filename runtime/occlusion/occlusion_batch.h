// occlusion_batch.h: looks at many sources from one place, on all cores: for exact renders.
//
// The same looks as fresnel_visibility() takes one at a time, in 50 to 70 % of the time: sources
// are taken in the order in which they lie in space, and of kPacketRays neighbours the same way
// round is cast at once, as a packet of rays. So near each other, with one end in common, they go
// the same way down the tree of surfaces. (Only where a ray comes through the edge between two
// surfaces may a packet find the other one: one way of six million in a cathedral.)
//
// What lies side by side is a function of the lines alone: so is the outcome, whatever the threads.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

struct VisibilityEstimate {
  Bands around{};  // as fresnel_visibility() gives it
  bool straight = false;
  std::uint64_t rays = 0;  // cast for it
};

// Along each of the lines, in their order, all of which end in about one place. On so many threads,
// 0: as many as there are cores.
std::vector<VisibilityEstimate> estimate_visibilities(const OcclusionGeometry& geometry,
                                                      std::span<const LineOfSight> lines,
                                                      int paths_per_ring, unsigned threads = 0);

// What fine_visibility() of visibility_cache.h says of each.
std::vector<Bands> fine_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                                   std::span<const Source* const> sources, const Vec3& place,
                                   unsigned threads = 0);

}  // namespace clamor
