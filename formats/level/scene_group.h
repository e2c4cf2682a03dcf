// scene_group.h: the emitters below one node of the level's hierarchy.
//
// A designer who repeats a stand of fans repeats a node with its subtree. The level has a flat list
// of emitters; groups record which of them formed a subtree and in which coordinate frame, so that
// the bake can find congruent subtrees.
#pragma once

#include <cstddef>
#include <vector>

#include "common/vec.h"

namespace clamor {

struct SceneGroup {
  std::size_t first = 0, end = 0;  // range of at least two Level::emitters
  Matrix axes{1};                  // rotation of the node's frame
  Vec3 origin_m{};

  std::size_t size() const { return end - first; }
};

// Groups are disjoint or nested, inner groups first; no two have the same range.
using SceneGroups = std::vector<SceneGroup>;

}  // namespace clamor
