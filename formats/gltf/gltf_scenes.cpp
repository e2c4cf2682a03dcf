#include "formats/gltf/gltf_scenes.h"

#include <algorithm>
#include <charconv>
#include <span>

#include <fmt/format.h>

namespace clamor {

namespace {

std::span<const Json> scenes_of(const Json& document) {
  const Json* scenes = document.find("scenes");
  if (scenes == nullptr || scenes->array() == nullptr) return {};
  return *scenes->array();
}

std::string name_of(const Json& scene) {
  const Json* name = scene.find("name");
  return name == nullptr || name->string() == nullptr ? "" : *name->string();
}

// "1 'hall'".
std::string label_of(std::span<const Json> scenes, std::size_t index) {
  const std::string name = name_of(scenes[index]);
  return name.empty() ? std::to_string(index) : fmt::format("{} '{}'", index, name);
}

// The word after --scene that chooses a scene: its name, if no other has it.
std::string word_for(std::span<const Json> scenes, std::size_t index) {
  const std::string name = name_of(scenes[index]);
  const auto twins =
      std::ranges::count_if(scenes, [&](const Json& scene) { return name_of(scene) == name; });
  return name.empty() || twins > 1 ? std::to_string(index) : in_quotes(name);
}

struct Contents {
  std::size_t meshes = 0, triangles = 0;
};

// Counts what the nodes below the roots place, as the file states it. Marks these nodes.
Contents contents_below(const GltfScene& scene, std::vector<int> stack, std::vector<bool>& seen) {
  Contents contents;
  while (!stack.empty()) {
    const auto n = static_cast<std::size_t>(stack.back());
    stack.pop_back();
    if (seen[n]) continue;
    seen[n] = true;
    const GltfNode& node = scene.nodes[n];
    stack.insert(stack.end(), node.children.begin(), node.children.end());
    if (node.mesh == kNone) continue;
    ++contents.meshes;
    for (const auto& primitive : scene.meshes[static_cast<std::size_t>(node.mesh)].primitives) {
      const int accessor = primitive.indices != kNone ? primitive.indices : primitive.positions;
      constexpr int kTriangles = 4;
      if (accessor == kNone || primitive.mode < kTriangles) continue;
      const std::size_t count = scene.accessors[static_cast<std::size_t>(accessor)].count;
      contents.triangles +=
          primitive.mode == kTriangles ? count / 3 : count - std::min<std::size_t>(count, 2);
    }
  }
  return contents;
}

std::string in_words(const Contents& contents) {
  return fmt::format("{} triangle{} in {} mesh{}", contents.triangles,
                     contents.triangles == 1 ? "" : "s", contents.meshes,
                     contents.meshes == 1 ? "" : "es");
}

}  // namespace

Result<std::optional<std::size_t>> choose_scene(const Json& document,
                                                const std::optional<std::string>& wanted) {
  const auto scenes = scenes_of(document);
  using Index = std::optional<std::size_t>;
  if (!wanted) {
    if (scenes.empty()) return Index();
    const Json* scene = document.find("scene");  // checked, as are all indices
    return Index(scene == nullptr ? 0 : static_cast<std::size_t>(*scene->number()));
  }
  for (std::size_t i = 0; i < scenes.size(); ++i)
    if (name_of(scenes[i]) == *wanted) return Index(i);
  std::size_t number = 0;
  const char* const end = wanted->data() + wanted->size();
  const auto [rest, wrong] = std::from_chars(wanted->data(), end, number);
  if (wrong == std::errc() && rest == end && number < scenes.size()) return Index(number);
  std::string list;
  for (std::size_t i = 0; i < scenes.size(); ++i) list += (i > 0 ? ", " : "") + label_of(scenes, i);
  return Error(fmt::format("has no scene '{}'; {}. Give --scene one of their names or numbers.",
                           *wanted, scenes.empty() ? "it has no scenes at all" : "it has " + list));
}

std::vector<int> scene_roots(const GltfScene& scene, std::optional<std::size_t> index) {
  std::vector<int> roots;
  if (index) {
    const Json* nodes = scenes_of(scene.json)[*index].find("nodes");
    if (nodes != nullptr)
      for (const Json& node : *nodes->array()) roots.push_back(static_cast<int>(*node.number()));
    return roots;
  }
  std::vector<bool> is_child(scene.nodes.size(), false);
  for (const GltfNode& node : scene.nodes)
    for (const int child : node.children) is_child[static_cast<std::size_t>(child)] = true;
  for (std::size_t i = 0; i < scene.nodes.size(); ++i)
    if (!is_child[i]) roots.push_back(static_cast<int>(i));
  return roots;
}

void report_other_scenes(const GltfScene& scene, std::optional<std::size_t> chosen,
                         ImportReport& report) {
  const auto scenes = scenes_of(scene.json);
  if (!chosen) return;
  std::vector<bool> seen(scene.nodes.size(), false);
  const Contents own = contents_below(scene, scene.roots, seen);
  std::vector<bool> in_any = seen;
  std::string others;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (i == *chosen) continue;
    std::vector<bool> of_this(scene.nodes.size(), false);
    const Contents contents = contents_below(scene, scene_roots(scene, i), of_this);
    for (std::size_t n = 0; n < of_this.size(); ++n) in_any[n] = in_any[n] || of_this[n];
    const std::string line =
        fmt::format("scene {} with {} (--scene {} bakes it)", label_of(scenes, i),
                    in_words(contents), word_for(scenes, i));
    if (own.meshes == 0 && contents.meshes > 0) others += (others.empty() ? "" : ", ") + line;
    report.ignored.push_back(line);
  }
  if (!others.empty())
    report.warnings.push_back(
        fmt::format("scene {} is baked, which has no meshes, while there is {}",
                    label_of(scenes, *chosen), others));
  std::vector<int> rest;
  for (std::size_t n = 0; n < in_any.size(); ++n)
    if (!in_any[n]) rest.push_back(static_cast<int>(n));
  const Contents nowhere = contents_below(scene, std::move(rest), in_any);
  if (nowhere.meshes > 0)
    report.ignored.push_back(in_words(nowhere) + " on nodes that belong to no scene");
}

}  // namespace clamor
