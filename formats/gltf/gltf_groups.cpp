#include "formats/gltf/gltf_groups.h"

#include <algorithm>

namespace clamor {

namespace {

SceneGroup group_of(std::size_t first, std::size_t end, const glm::dmat4& world) {
  return {first, end, Matrix(world), Vec3(world[3])};
}

// Removes groups that are too small or have the same range as another.
void tidy(SceneGroups& groups) {
  SceneGroups kept;
  for (const SceneGroup& group : groups)
    if (group.size() >= 2 &&
        (kept.empty() || kept.back().first != group.first || kept.back().end != group.end))
      kept.push_back(group);
  groups = std::move(kept);
}

}  // namespace

SceneGroups scene_groups(const GltfScene& scene, std::span<const int> nodes) {
  struct Visit {
    int node;
    glm::dmat4 parent, world;
    bool entered;
    std::size_t first;  // index of an emitter
  };
  SceneGroups groups;
  std::vector<Visit> stack;
  for (auto it = scene.roots.rbegin(); it != scene.roots.rend(); ++it)
    stack.push_back({*it, glm::dmat4(1.0), glm::dmat4(1.0), false, 0});
  std::size_t next = 0;  // next emitter, in the order of place_nodes(): parents first
  while (!stack.empty() && next < nodes.size()) {
    const Visit visit = stack.back();
    const GltfNode& node = scene.nodes[static_cast<std::size_t>(visit.node)];
    stack.pop_back();
    if (visit.entered) {
      groups.push_back(group_of(visit.first, next, visit.world));
      continue;
    }
    const std::size_t first = next;
    const glm::dmat4 world = visit.parent * node.local;
    while (next < nodes.size() && nodes[next] == visit.node) ++next;
    stack.push_back({visit.node, visit.parent, world, true, first});
    for (auto it = node.children.rbegin(); it != node.children.rend(); ++it)
      stack.push_back({*it, world, world, false, 0});
  }
  for (auto it = stack.rbegin(); it != stack.rend(); ++it)
    if (it->entered) groups.push_back(group_of(it->first, next, it->world));
  tidy(groups);
  return groups;
}

void remove_emitters(const std::vector<bool>& gone, SceneGroups& groups) {
  std::vector<std::size_t> places(gone.size() + 1, 0);  // new indices
  for (std::size_t i = 0; i < gone.size(); ++i) places[i + 1] = places[i] + (gone[i] ? 0 : 1);
  for (SceneGroup& group : groups) {
    group.first = places[group.first];
    group.end = places[group.end];
  }
  tidy(groups);
}

}  // namespace clamor
