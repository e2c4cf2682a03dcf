// occlusion_batch.h: visibility of many sources from one place, on all cores, for exact renders.
//
// The estimates equal those of fresnel_visibility(), which takes one source at a time, in 50 to
// 70 % of the time. Sources are sorted along a space-filling curve, and the same detour path of
// kPacketRays neighbours is cast as one packet of coherent rays. (Where a ray passes through the
// edge between two surfaces, a packet may find the other surface: one path of six million in a
// cathedral.)
//
// Packets are formed from the lines alone, so the result does not depend on the number of threads.
#pragma once

#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/visibility_estimate.h"

namespace clamor {

// Estimates by fresnel_visibility() for the lines, in their order; all lines end at about the same
// place. `threads` of 0 means one per core.
std::vector<VisibilityEstimate> estimate_visibilities(const OcclusionGeometry& geometry,
                                                      std::span<const LineOfSight> lines,
                                                      int paths_per_ring, unsigned threads = 0);

// fine_visibility() of visibility_cache.h for each of the sources.
std::vector<Bands> fine_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                                   std::span<const Source* const> sources, const Vec3& place,
                                   unsigned threads = 0);

}  // namespace clamor
