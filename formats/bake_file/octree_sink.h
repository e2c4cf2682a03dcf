// octree_sink.h: takes an octree piece by piece, children before their parents.
//
// For octrees that nobody can hold whole. Whoever builds one hands over what is finished and keeps
// a handle of it, a number that the sink makes up, to name it as a child of a node above.
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

  // A part of the tree with all that is below it; its node 0 is its top. Never empty. Returns its
  // handle; after an Error there are no further calls.
  virtual Result<std::size_t> add_subtree(SourceOctree&& subtree) = 0;

  // A single node: its own sources by descending key, and by octant the handles of what is below
  // it, each named by one parent only.
  virtual Result<std::size_t> add_node(
      const NodeSummary& node, std::span<const Source> sources,
      const std::array<std::optional<std::size_t>, 8>& children) = 0;
};

}  // namespace clamor
