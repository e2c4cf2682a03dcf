// source_octree.h: all sources of a bake, in a heap-ordered octree.
//
// The key of a source is its power, weighed as the sampler will weigh it, over u. A node holds all
// that is in its cube, in descending order of keys, if that is no more than kLeafSources, or else
// the kNodeSources highest and hands the rest to its children. So each source is stored once, the
// first of a node represents all that the node contains, and the top of the tree is an importance
// sample of the level. One node is one page. Leaves may be larger because there are more of them
// than of all others: at 512 those of a stadium held 180 sources on average and took 0.3 bytes more
// for each. And octants that follow each other are one leaf as long as they have no more than one
// may hold: ten million sources in Sponza take 16 100 pages instead of 28 741 and 2 % less, and a
// keyframe a tenth less.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/instance.h"
#include "formats/bake_file/source.h"

namespace clamor {

inline constexpr std::uint32_t kNodeSources = 512, kLeafSources = 1000;
inline constexpr std::uint32_t kNoNode = 0xffffffff;

// What the octree is ordered by. Pages are sorted by it when they are read, so a change of it is a
// change of the file format.
inline float octree_key(const Source& source) {
  double power = 0;
  for (const float p : source.power) power += p;
  return static_cast<float>(power / source.u);
}

// The cube of space that a node divides among its children. Below a millionth of the level's edge
// nodes are chained by their first child, wherever their sources are.
struct OctreeCube {
  static constexpr int kDeepest = 20;

  Vec3 centre_m{};
  double half_edge_m = 0;
  int depth = 0;

  // Of all sources, given their bounds.
  static OctreeCube around(const Vec3& low_m, const Vec3& high_m) {
    const Vec3 size = high_m - low_m;
    return {(low_m + high_m) / 2.0, std::max({size.x, size.y, size.z}) / 2, 0};
  }

  // Which octant holds a position.
  std::size_t octant_of(const Vec3& position_m) const {
    if (depth >= kDeepest) return 0;
    return (position_m.x >= centre_m.x ? 1u : 0u) | (position_m.y >= centre_m.y ? 2u : 0u) |
           (position_m.z >= centre_m.z ? 4u : 0u);
  }

  OctreeCube child(std::size_t octant) const {
    const double half = half_edge_m / 2;
    const Vec3 step((octant & 1) ? half : -half, (octant & 2) ? half : -half,
                    (octant & 4) ? half : -half);
    return {centre_m + step, half, depth + 1};
  }
};

// What is known of a node without its page.
struct NodeSummary {
  Vec3f low_m{}, high_m{};   // tight bounds of all sources in the node and below
  float highest_key = 0;     // of the node and everything below
  Bands power{};             // summed over the node and below
  Vec3f cone_axis{0, 0, 1};  // emission of all in and below lies in this cone
  float cone_cos = -1;       // cosine of its half angle; -1 for all directions
  float min_delay_s = 0, max_delay_s = 0;
  std::uint32_t source_count = 0;  // of the node alone
};

struct OctreeNode : NodeSummary {
  std::array<std::uint32_t, 8> children = {kNoNode, kNoNode, kNoNode, kNoNode,
                                           kNoNode, kNoNode, kNoNode, kNoNode};
  std::uint64_t first_source = 0;                        // into SourceOctree::sources
  std::uint32_t first_instance = 0, instance_count = 0;  // into SourceOctree::instances
  // Its children are the octants of its cube: each has its own, and those after it up to the next
  // child's, which are a leaf together then.
  bool divides_space = true;
};

// Children come after their parent; node 0 is the root. Empty when there are no sources. Copies of
// other trees (instance.h) are in any nodes; a tree of nothing but copies has nodes without
// sources.
struct SourceOctree {
  std::vector<OctreeNode> nodes;
  std::vector<Source> sources;      // node after node, each by descending key
  std::vector<Instance> instances;  // node after node
};

}  // namespace clamor
