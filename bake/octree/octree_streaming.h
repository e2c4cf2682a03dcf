// octree_streaming.h: sorts sources that do not fit into memory into the heap-ordered octree.
//
// An external sort from the top: a cell's sources are read once, its highest keys (known since the
// sources were written) are kept, the others go to one file for each octant, and so on; as soon as
// a cell fits, build_octree() does the rest. Where space is divided no further, sorted runs are
// merged. What the sink is given is, node by node, the tree that build_octree() makes of the list.
//
// Threads: as many as the TBB arena it is called in; the sink is called by one at a time, in an
// order that depends on the sources and on the memory only.
// Disk: twice the list, for a moment; each source is written about log4(list / memory) times.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "bake/octree/source_spill.h"
#include "common/result.h"
#include "formats/bake_file/octree_sink.h"

namespace clamor {

// Returns the handle of the root, none if there are no sources. Takes `memory_bytes` at most,
// beside what the sink takes, but 1 MB in any case.
Result<std::optional<std::size_t>> stream_octree(SourceSpill sources, std::uint64_t memory_bytes,
                                                 OctreeSink& sink);

}  // namespace clamor
