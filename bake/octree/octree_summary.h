// octree_summary.h: what a node says of all that lies in and below it.
#pragma once

#include <span>

#include "formats/bake_file/source_octree.h"

namespace clamor {

// Sets all but source_count of a node from its own sources, by descending key, and from its
// children, by octant. Sums run in that order, so a summary is the same however its tree is built.
// Copies in it are for include_instances() to add.
void summarise(NodeSummary& node, std::span<const Source> own,
               std::span<const NodeSummary* const> children);

}  // namespace clamor
