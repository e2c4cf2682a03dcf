#include "formats/gltf/gltf_scenes.h"

#include <algorithm>
#include <charconv>
#include <span>

#include <fmt/format.h>

#include "formats/gltf/report_words.h"

namespace clamor {

namespace {

// "1 'hall'".
std::string label_of(std::span<const Json> scenes, std::size_t index) {
  const std::string name = scenes[index].text("name");
  return name.empty() ? std::to_string(index) : fmt::format("{} '{}'", index, name);
}

// The word after --scene that chooses a scene: its name, if no other has it.
std::string word_for(std::span<const Json> scenes, std::size_t index) {
  const std::string name = scenes[index].text("name");
  const auto twins =
      std::ranges::count_if(scenes, [&](const Json& scene) { return scene.text("name") == name; });
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
      const int accessor = primitive.indices != kNone ? primitive.indices : primitive.positions();
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
  return number_of(contents.triangles, "triangle") + " in " + number_of(contents.meshes, "mesh");
}

// The nodes of a scene; without one, all nodes that have no parent.
std::vector<int> scene_roots(const GltfScene& scene, std::optional<std::size_t> index) {
  std::vector<int> roots;
  if (index) {
    for (const Json& node : scene.json.list("scenes")[*index].list("nodes"))
      roots.push_back(static_cast<int>(*node.number()));
    return roots;
  }
  for (std::size_t i = 0; i < scene.nodes.size(); ++i)
    if (scene.nodes[i].parent == kNone) roots.push_back(static_cast<int>(i));
  return roots;
}

// The index of the scene that is wanted.
Result<std::size_t> find_scene(std::span<const Json> scenes, const std::string& wanted) {
  for (std::size_t i = 0; i < scenes.size(); ++i)
    if (scenes[i].text("name") == wanted) return i;
  std::size_t number = 0;
  const char* const end = wanted.data() + wanted.size();
  const auto [rest, wrong] = std::from_chars(wanted.data(), end, number);
  if (wrong == std::errc() && rest == end && number < scenes.size()) return number;
  std::string list;
  for (std::size_t i = 0; i < scenes.size(); ++i) list += (i > 0 ? ", " : "") + label_of(scenes, i);
  return Error(fmt::format("has no scene '{}'; {}. Give --scene one of their names or numbers.",
                           wanted, scenes.empty() ? "it has no scenes at all" : "it has " + list));
}

}  // namespace

Result<void> choose_scene(GltfScene& scene, const std::optional<std::string>& wanted) {
  if (wanted) {
    const auto found = find_scene(scene.json.list("scenes"), *wanted);
    if (!found.ok()) return found.error();
    scene.chosen = *found;
  } else if (!scene.json.list("scenes").empty()) {
    const double* standard = scene.json.number("scene");
    scene.chosen = standard == nullptr ? 0 : static_cast<std::size_t>(*standard);
  }
  scene.roots = scene_roots(scene, scene.chosen);
  return {};
}

void report_other_scenes(const GltfScene& scene, ImportReport& report) {
  const auto scenes = scene.json.list("scenes");
  if (!scene.chosen) return;
  std::vector<bool> seen(scene.nodes.size(), false);
  const Contents own = contents_below(scene, scene.roots, seen);
  std::vector<bool> in_any = seen;
  std::string others;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (i == *scene.chosen) continue;
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
                    label_of(scenes, *scene.chosen), others));
  std::vector<int> rest;
  for (std::size_t n = 0; n < in_any.size(); ++n)
    if (!in_any[n]) rest.push_back(static_cast<int>(n));
  const Contents nowhere = contents_below(scene, std::move(rest), in_any);
  if (nowhere.meshes > 0)
    report.ignored.push_back(in_words(nowhere) + " on nodes that belong to no scene");
}

}  // namespace clamor
