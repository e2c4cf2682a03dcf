// octree_streaming.h: builds the heap-ordered octree from sources on disk.
//
// The build is a top-down external sort between two lists, in files or in memory. The highest keys
// of a cell stay in its node, and the others go to the other list, octant after octant. Once a cell
// fits into memory, build_octree() finishes it. Node by node, the sink receives the tree that
// build_octree() would make of the list.
//
// Threads: the caller's team. Calls of the sink are serialised, each node after its
// children, in the order of the octants. Disk: twice the list; each source is written about
// log4(list / memory) times.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "bake/octree/scratch_list.h"
#include "common/result.h"
#include "formats/bake_file/octree_sink.h"

namespace clamor {

// Returns the handle of the root, or nothing without sources. Uses at most `memory_bytes` (at least
// 1 MB), not counting the sink and a list in memory; of sources at one place, 8 bytes each.
Result<std::optional<std::size_t>> stream_octree(ScratchList<Source> sources,
                                                 std::uint64_t memory_bytes, OctreeSink& sink);

}  // namespace clamor
