// source_octree.h: all sources of a bake, in a heap-ordered octree.
//
// The key of a source is its power over u. A node with at most kLeafSources sources in its cube is
// a leaf and stores them all, in descending order of keys. Any other node stores the kNodeSources
// highest keys and passes the rest to its children. So each source is stored once, the first source
// of a node represents the node, and the top of the tree is an importance sample of the level. One
// node is one page.
//
// Leaves are larger than inner nodes because they are the majority: with 512, those of a stadium
// held 180 sources on average and took 0.3 bytes more per source. Consecutive octants share a leaf
// while they fit: ten million sources in Sponza take 16 100 pages instead of 28 741, 2 % fewer
// bytes, and a tenth less time per keyframe.
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

// The key that orders the octree. Readers sort pages by it, so changing it changes the file format.
inline float octree_key(const Source& source) {
  double power = 0;
  for (const float p : source.power) power += p;
  return static_cast<float>(power / source.u);
}

// The cube that a node divides among its children. Beyond the maximum depth, a millionth of the
// level's edge, nodes form a chain of first children.
struct OctreeCube {
  static constexpr int kDeepest = 20;

  Vec3 centre_m{};
  double half_edge_m = 0;
  int depth = 0;

  // The root cube around the bounds of all sources.
  static OctreeCube around(const Vec3& low_m, const Vec3& high_m) {
    const Vec3 size = high_m - low_m;
    return {(low_m + high_m) / 2.0, std::max({size.x, size.y, size.z}) / 2, 0};
  }

  // The octant that contains a position.
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

// Attributes of a node that are known without its page.
struct NodeSummary {
  Vec3f low_m{}, high_m{};   // tight bounds of all sources of the subtree
  float highest_key = 0;     // of the subtree
  Bands power{};             // sum over the subtree
  Vec3f cone_axis{0, 0, 1};  // cone of emission directions of the subtree
  float cone_cos = -1;       // cosine of its half angle; -1 for all directions
  float min_delay_s = 0, max_delay_s = 0;
  std::uint32_t source_count = 0;  // of the node itself
};

struct OctreeNode : NodeSummary {
  std::array<std::uint32_t, 8> children = {kNoNode, kNoNode, kNoNode, kNoNode,
                                           kNoNode, kNoNode, kNoNode, kNoNode};
  std::uint64_t first_source = 0;                        // into SourceOctree::sources
  std::uint32_t first_instance = 0, instance_count = 0;  // into SourceOctree::instances
  // Children correspond to octants. A child that covers several consecutive octants, up to that of
  // the next child, is a leaf.
  bool divides_space = true;
};

// Parents precede children; node 0 is the root. Empty if there are no sources. Any node may contain
// instances of other trees (instance.h); a tree of instances alone has nodes without sources.
struct SourceOctree {
  std::vector<OctreeNode> nodes;
  std::vector<Source> sources;      // node after node, each by descending key
  std::vector<Instance> instances;  // node after node
};

}  // namespace clamor
