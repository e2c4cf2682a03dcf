#include "formats/gltf/gltf_placement.h"

#include <array>
#include <optional>
#include <span>

#include <fmt/format.h>

#include "formats/gltf/gltf_accessor.h"
#include "formats/level/emitter_spec.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxPlacements = 10'000'000;
constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

std::string label(const GltfScene& scene, int node) {
  const std::string& name = scene.nodes[static_cast<std::size_t>(node)].name;
  return fmt::format("node {}{}", node, name.empty() ? "" : " " + in_quotes(name));
}

// An instance relative to its node.
struct InstancePlace {
  glm::dmat4 local{1.0};
  double delay_s = 0;
};

// Reads EXT_mesh_gpu_instancing, which reserves names that begin with _ for applications.
Result<std::vector<InstancePlace>> instance_places(const GltfScene& scene, const Json& extension) {
  constexpr std::array<const char*, 4> kNames = {"TRANSLATION", "ROTATION", "SCALE", "_DELAY_S"};
  constexpr std::array kComponents = {3, 4, 3, 1};
  std::optional<GltfReader> readers[kNames.size()];
  std::optional<std::size_t> count;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const Json* value = extension.find({"attributes", kNames[i]});
    if (value == nullptr) continue;
    const auto accessor = index_below(value, scene.accessors.size());
    if (!accessor)
      return Error(
          fmt::format("{} '{}' points to none of the {} accessors; export the level again.",
                      kInstancing, kNames[i], scene.accessors.size()));
    auto reader = GltfReader::open(scene, static_cast<int>(*accessor), kComponents[i]);
    if (!reader.ok()) return reader.error().in(kInstancing);
    if (count.value_or(reader->count()) != reader->count())
      return Error(
          fmt::format("{} has {} of '{}' but {} of another attribute; export the level again.",
                      kInstancing, reader->count(), kNames[i], *count));
    count = reader->count();
    readers[i] = std::move(*reader);
  }
  if (!count)
    return Error(
        fmt::format("{} has none of TRANSLATION, ROTATION, SCALE and _DELAY_S, so nothing says how "
                    "many instances there are; export the level again.",
                    kInstancing));

  if (*count > kMaxPlacements)
    return Error(fmt::format("has {} instances; at most {} are read.", *count, kMaxPlacements));
  std::vector<InstancePlace> places(*count);
  for (std::size_t i = 0; i < *count; ++i) {
    std::array<double, 4> values[3];
    std::span<const double> parts[3];
    for (std::size_t part = 0; part < 3; ++part)
      if (readers[part]) parts[part] = values[part] = readers[part]->at(i);
    places[i].local = transform_of(parts[0], parts[1], parts[2]);
    if (readers[3]) {
      places[i].delay_s = readers[3]->at(i)[0];
      if (!(places[i].delay_s >= 0 && places[i].delay_s <= kMaxDelay_s))
        return Error(fmt::format("{} {}: '_DELAY_S' must lie between 0 and {} seconds", kInstancing,
                                 i, kMaxDelay_s));
    }
  }
  return places;
}

}  // namespace

Result<std::vector<PlacedNode>> place_nodes(const GltfScene& scene) {
  struct Visit {
    int node;
    glm::dmat4 parent;
  };
  std::vector<PlacedNode> placements;
  std::vector<bool> visited(scene.nodes.size(), false);
  std::vector<Visit> stack;
  const auto nodes = scene.json.list("nodes");
  for (auto it = scene.roots.rbegin(); it != scene.roots.rend(); ++it)
    stack.push_back({*it, glm::dmat4(1.0)});

  while (!stack.empty()) {
    const Visit visit = stack.back();
    stack.pop_back();
    const auto n = static_cast<std::size_t>(visit.node);
    if (visited[n])
      return Error(label(scene, visit.node) +
                   " is reached twice: the hierarchy has a cycle or a "
                   "node with two parents; export the level again.");
    visited[n] = true;
    const GltfNode& node = scene.nodes[n];
    const Json* extensions = nodes[n].find("extensions");
    const glm::dmat4 world = visit.parent * node.local;
    // Pushed in reverse, so that children are popped in order.
    for (auto it = node.children.rbegin(); it != node.children.rend(); ++it)
      stack.push_back({*it, world});

    if (node.mesh == kNone && extensions == nullptr && nodes[n].find("extras") == nullptr) continue;
    const Json* instancing = extensions == nullptr ? nullptr : extensions->find(kInstancing);
    if (instancing == nullptr) {
      placements.push_back({visit.node, 0, false, world});
      continue;
    }
    const auto instances = instance_places(scene, *instancing);
    if (!instances.ok()) return instances.error().in(label(scene, visit.node));
    if (placements.size() + instances->size() > kMaxPlacements)
      return Error(
          fmt::format("{}: the level has more than {} instances, the most that are read; "
                      "thin them out.",
                      label(scene, visit.node), kMaxPlacements));
    for (std::size_t i = 0; i < instances->size(); ++i)
      placements.push_back({visit.node, static_cast<std::uint32_t>(i), true,
                            world * (*instances)[i].local, (*instances)[i].delay_s});
  }
  return placements;
}

}  // namespace clamor
