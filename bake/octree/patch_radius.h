// patch_radius.h: how large a patch of wall each secondary source stands for.
//
// A secondary source is not a point but its share of a lit wall, so its 1 / r^2 must stop growing
// when the listener comes closer than the patch is large; else single sources jump out near walls.
// With sigma the mean power per area of the 16 nearest deposits, the source's own power P fills a
// disc of
//
//   pi D^2 = P / sigma,     D = d sqrt(P / sum of the 16 powers),   d the distance to the farthest:
//
// strong sources get large patches, so that none is more than its share of the wall around it. Such
// a disc, Lambertian, gives a receiver at its centre 2 P / (pi D^2), where a point gives P / (pi
// r^2): 1 / r^2 stops growing at R = D / sqrt(2). (Stopping at D loses 0.2 dB of the mean level of
// a room.)
#pragma once

#include <span>

#include "formats/bake_file/source.h"

namespace clamor {

// Sets patch_radius_m of every source. Deterministic for any number of threads. O(n log n).
void set_patch_radii(std::span<Source> secondary_sources);

}  // namespace clamor
