// patch_radius_on_disk.h: patch radii of sources that exceed the memory.
//
// Sources are divided by space into parts that fit into the memory. A source whose neighbours may
// lie beyond the borders of its part is looked up in the other parts, too.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "bake/octree/scratch_file.h"
#include "common/result.h"
#include "formats/bake_file/source.h"

namespace clamor {

// Passes the sources, always in the same order.
using ForEachSource =
    std::function<Result<void>(const std::function<Result<void>(std::span<Source>)>& visit)>;

// The radii that set_patch_radii() would set, in the order in which `for_each` passes the `count`
// sources. `for_some` passes sources that are spread in space as all are; they decide only how
// space is divided. Each is called once. Threads: the caller's team. Disk: 28 bytes
// per source, of which the radii take 4. Memory: `memory_bytes` (at least 10 MB).
Result<std::span<const float>> patch_radii_on_disk(const ForEachSource& for_each,
                                                   const ForEachSource& for_some,
                                                   std::uint64_t count, std::uint64_t memory_bytes,
                                                   const std::string& beside, ScratchFile& radii);

}  // namespace clamor
