// octree_sink.h: receives an octree piece by piece, children before parents.
//
// For octrees that do not fit into memory. The builder passes finished parts and keeps the handles
// that the sink returns, to name them as children of later nodes.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "common/result.h"
#include "formats/bake_file/source_octree.h"

namespace clamor {

class OctreeSink {
 public:
  virtual ~OctreeSink() = default;

  // Adds a complete subtree, not empty, whose node 0 is its root. Returns its handle. No calls may
  // follow an Error.
  virtual Result<std::size_t> add_subtree(SourceOctree&& subtree) = 0;

  // Adds a node with its sources by descending key and the handles of its children by octant. Every
  // handle has one parent.
  virtual Result<std::size_t> add_node(
      const NodeSummary& node, std::span<const Source> sources,
      const std::array<std::optional<std::size_t>, 8>& children) = 0;
};

}  // namespace clamor
