// patch_radius.h: estimates the surface patch that each secondary source represents.
//
// A secondary source is a sample of a lit wall, not a point. Its 1 / r^2 must stop growing when the
// listener is closer than the size of its patch; otherwise single sources stick out near walls.
// With sigma the mean power per area of the 16 nearest deposits, a source of power P fills a disc
// of
//
//   pi D^2 = P / sigma,     D = d sqrt(P / sum of the 16 powers),   d the distance to the farthest.
//
// Strong sources get large patches, so that none exceeds its share of the wall around it. A
// Lambertian disc gives a receiver at its centre the intensity 2 P / (pi D^2), where a point source
// gives P / (pi r^2). 1 / r^2 is therefore clamped at R = D / sqrt(2). (Clamping at D loses 0.2 dB
// of a room's mean level.)
#pragma once

#include <cstdint>
#include <span>

#include "bake/octree/scratch_list.h"
#include "common/result.h"
#include "formats/bake_file/source.h"

namespace clamor {

// The patch radii of the sources, in their order. Of neighbours at the same distance the weaker
// count first, so that the result depends on the sources alone, neither on the number of threads
// nor on the memory. With fewer than kNeighbours sources, the farthest neighbour is at the largest
// distance. O(n log n). Memory: 38 bytes per source; for a list in a file, those are in files, too,
// and `memory_bytes` (at least 10 MB) are the memory.
Result<ScratchList<float>> find_patch_radii(ScratchList<Source>& secondary_sources,
                                            std::uint64_t memory_bytes);

// Sets patch_radius_m of every source.
void set_patch_radii(std::span<Source> secondary_sources);

}  // namespace clamor
