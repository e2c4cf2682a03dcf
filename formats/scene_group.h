// scene_group.h: emitters that stand together in a level, under one node of its hierarchy.
//
// A designer who repeats a stand of fans repeats a node with all that is below it. The level keeps
// a flat list of emitters; these groups remember what of it was one subtree, and the frame it was
// laid out in, so that the bake can look for subtrees that are alike.
#pragma once

#include <cstddef>
#include <vector>

#include <glm/glm.hpp>

namespace clamor {

struct SceneGroup {
  std::size_t first = 0, end = 0;  // a range of Level::emitters, two at least
  glm::dmat4 frame{1.0};           // of the node, in the level

  std::size_t size() const { return end - first; }
};

// Groups are disjoint or one within the other, those within first; no two are the same range.
using SceneGroups = std::vector<SceneGroup>;

}  // namespace clamor
