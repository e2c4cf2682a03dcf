// octree_summary.h: computes the summary of an octree node.
#pragma once

#include <span>

#include "formats/bake_file/source_octree.h"

namespace clamor {

// Sets all members but source_count from the node's own sources (by descending key) and its
// children (by octant). Sums run in that order, so that the builders in memory and on disk agree.
// Instances are added by include_instances().
void summarise(NodeSummary& node, std::span<const Source> own,
               std::span<const NodeSummary* const> children);

}  // namespace clamor
