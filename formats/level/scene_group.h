// scene_group.h: emitters that stand together in a level, under one node of its hierarchy.
//
// A designer who repeats a stand of fans repeats a node with all that is below it. The level keeps
// a flat list of emitters; these groups remember what of it was one subtree, and the frame it was
// laid out in, so that the bake can look for subtrees that are alike.
#pragma once

#include <cstddef>
#include <vector>

#include "common/vec.h"

namespace clamor {

struct SceneGroup {
  std::size_t first = 0, end = 0;  // a range of Level::emitters, two at least
  Matrix axes{1};                  // of the node's frame in the level, and its origin
  Vec3 origin_m{};

  std::size_t size() const { return end - first; }
};

// Groups are disjoint or one within the other, those within first; no two are the same range.
using SceneGroups = std::vector<SceneGroup>;

}  // namespace clamor
