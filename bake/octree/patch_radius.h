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
#include <functional>
#include <span>
#include <string>

#include "bake/octree/scratch_file.h"
#include "common/result.h"
#include "formats/bake_file/source.h"

namespace clamor {

// Sets patch_radius_m of every source. Of neighbours at the same distance the weaker count first,
// so that the result depends on the sources alone. It does not depend on the number of threads. O(n
// log n).
void set_patch_radii(std::span<Source> secondary_sources);

// The same radii for sources that exceed the memory, in the order in which `for_each` passes them;
// it is called twice. Sources are divided by space into lists that fit into the memory. A source
// whose neighbours may lie in other lists is looked up there, too. Disk: 28 bytes per source, of
// which the radii take 4. Memory: `memory_bytes` (at least 10 MB).
using ForEachSource =
    std::function<Result<void>(const std::function<Result<void>(std::span<Source>)>& visit)>;
Result<std::span<const float>> patch_radii_on_disk(const ForEachSource& for_each,
                                                   std::uint64_t count, std::uint64_t memory_bytes,
                                                   const std::string& beside, ScratchFile& radii);

}  // namespace clamor
