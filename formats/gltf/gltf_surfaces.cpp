#include "formats/gltf/gltf_surfaces.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "common/text.h"
#include "formats/gltf/report_words.h"

namespace clamor {

namespace {

bool says_no(const Json* value) {
  if (value == nullptr) return false;
  if (value->boolean() != nullptr) return !*value->boolean();
  return value->number() != nullptr && *value->number() == 0;
}

bool is_hidden(const Json& node) {
  return says_no(node.find({"extensions", "KHR_node_visibility", "visible"})) ||
         says_no(node.find({"extensions", "MOZ_hubs_components", "visible", "visible"})) ||
         says_no(node.find({"extras", "visible"}));
}

// The material has no opaque point: its factor is 0, and its mode says that this counts.
bool is_transparent(const Json& material) {
  const std::string mode = material.text("alphaMode");
  const Json* look = material.find("pbrMetallicRoughness");
  if (mode.empty() || mode == "OPAQUE" || look == nullptr) return false;
  const auto factor = look->list("baseColorFactor");
  return factor.size() == 4 && factor[3].number() != nullptr && *factor[3].number() <= 0;
}

std::string_view mesh_name(const GltfScene& scene, const GltfNode& node) {
  return node.mesh == kNone ? std::string_view{}
                            : scene.meshes[static_cast<std::size_t>(node.mesh)].name;
}

class SurfaceSearch {
 public:
  SurfaceSearch(const GltfScene& scene, SurfaceChoice& choice, bool with_hidden)
      : scene_(scene), choice_(choice), with_hidden_(with_hidden) {
    found_.nodes.assign(scene.nodes.size(), NoSurface::kNothing);
    found_.kept_nodes.assign(scene.nodes.size(), false);
    found_.materials.assign(scene.materials.size(), NoSurface::kNothing);
  }

  SceneSurfaces run(ImportReport& report) {
    find_materials();
    find_names();
    walk(report);
    return std::move(found_);
  }

 private:
  void find_materials() {
    const auto materials = scene_.json.list("materials");
    for (std::size_t m = 0; m < scene_.materials.size(); ++m) {
      const std::string& name = scene_.materials[m];
      NoSurface& reason = found_.materials[m];
      if (const auto keeps = choice_.keeps(name))
        reason = *keeps ? NoSurface::kNothing : NoSurface::kIgnored;
      else if (is_sky(name))
        reason = NoSurface::kSky;
      else if (is_transparent(materials[m]))
        reason = NoSurface::kTransparent;
    }
  }

  void find_names() {
    for (const GltfNode& node : scene_.nodes)
      names_.add(node.name.empty() ? mesh_name(scene_, node) : node.name, node.mesh != kNone);
    for (const Json& node : scene_.json.list("nodes"))
      if (const Json* lod = node.find({"extensions", "MSFT_lod"}))
        for (const Json& id : lod->list("ids"))
          if (id.number() != nullptr) lower_details_.insert(*id.number());
  }

  void walk(ImportReport& report) {
    struct Visit {
      int node;
      bool kept;
      NoSurface parent;
    };
    bool is_any_left = false;
    std::vector<std::size_t> by_name;
    std::vector<Visit> stack;
    for (const int root : scene_.roots) stack.push_back({root, false, NoSurface::kNothing});
    while (!stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      const auto n = static_cast<std::size_t>(visit.node);
      const GltfNode& node = scene_.nodes[n];
      auto keeps = choice_.keeps(node.name);
      const auto of_mesh = choice_.keeps(mesh_name(scene_, node));
      if (!keeps) keeps = of_mesh;
      NoSurface& reason = found_.nodes[n];
      const bool kept = keeps.value_or(visit.kept);
      if (keeps)
        reason = *keeps ? NoSurface::kNothing : NoSurface::kIgnored;
      else if (kept || visit.parent != NoSurface::kNothing)
        reason = visit.parent;
      else
        reason = by_rules(n);
      found_.kept_nodes[n] = kept;
      for (const int child : node.children) stack.push_back({child, kept, reason});
      if (node.mesh == kNone) continue;
      is_any_left |= reason == NoSurface::kNothing || reason == NoSurface::kIgnored;
      if (reason > NoSurface::kHidden) by_name.push_back(n);
      if (reason == NoSurface::kNothing && names_.is_lone(node.name))
        report.found.push_back(fmt::format(
            "{} is a surface: Godot shows a mesh of this name and makes its collider or occluder "
            "of it; --ignore NAME leaves it out",
            in_quotes(node.name)));
    }
    if (is_any_left || by_name.empty()) return;
    report.warnings.push_back(fmt::format(
        "every mesh has the name of a helper, as {} has that of a {}; all are taken for surfaces, "
        "since nothing else is there (--ignore NAME leaves one out)",
        in_quotes(node_name(scene_, by_name.front())), in_words(found_.nodes[by_name.front()])));
    for (const std::size_t n : by_name) found_.nodes[n] = NoSurface::kNothing;
  }

  NoSurface by_rules(std::size_t n) const {
    const GltfNode& node = scene_.nodes[n];
    const Json& json = scene_.json.list("nodes")[n];
    if (is_hidden(json)) return with_hidden_ ? NoSurface::kNothing : NoSurface::kHidden;
    if (lower_details_.contains(static_cast<double>(n))) return NoSurface::kLevelOfDetail;
    if (json.find({"extensions", "MOZ_hubs_components", "nav-mesh"}) != nullptr)
      return NoSurface::kNavigationMesh;
    const std::string_view mesh = mesh_name(scene_, node);
    const NoSurface reason = names_.reason_for(node.name.empty() ? mesh : node.name);
    if (reason != NoSurface::kNothing) return reason;
    // Only names of nodes say which mesh belongs to which.
    return MeshNames().reason_for(mesh);
  }

  const GltfScene& scene_;
  SurfaceChoice& choice_;
  const bool with_hidden_;
  MeshNames names_;
  std::set<double> lower_details_;  // nodes that MSFT_lod lists
  SceneSurfaces found_;
};

void warn_of_unused(const GltfScene& scene, const SurfaceChoice& choice, ImportReport& report) {
  const std::vector<std::string> unused = choice.unused();
  if (unused.empty()) return;
  std::vector<std::string> names = scene.materials;
  for (const GltfNode& node : scene.nodes) names.push_back(node.name);
  for (const GltfMesh& mesh : scene.meshes) names.push_back(mesh.name);
  std::erase(names, "");
  for (const std::string& glob : unused)
    report.warnings.push_back(fmt::format(
        "the pattern '{}' of what to ignore or keep matches no node, mesh or material; the nearest "
        "is '{}'",
        glob, nearest_name(glob, names)));
}

}  // namespace

SceneSurfaces find_surfaces(const GltfScene& scene, SurfaceChoice choice, bool with_hidden,
                            ImportReport& report) {
  auto found = SurfaceSearch(scene, choice, with_hidden).run(report);
  warn_of_unused(scene, choice, report);
  return found;
}

std::string left_out_line(NoSurface reason, const std::vector<std::string>& names) {
  const std::string line = number_of(names.size(), in_words(reason)) + ": " + first_names(names);
  if (reason == NoSurface::kIgnored) return line;
  if (reason == NoSurface::kHidden) return line + "; --hidden makes surfaces of them";
  if (names.size() > 1) return line + "; --keep NAME makes one a surface";
  return line + fmt::format("; --keep {} makes it a surface", in_quotes(names.front()));
}

std::string node_name(const GltfScene& scene, std::size_t node) {
  if (!scene.nodes[node].name.empty()) return scene.nodes[node].name;
  const std::string_view mesh = mesh_name(scene, scene.nodes[node]);
  return mesh.empty() ? fmt::format("node {}", node) : std::string(mesh);
}

void report_left_out(const GltfScene& scene, const std::vector<PlacedNode>& placements,
                     const SceneSurfaces& surfaces, ImportReport& report) {
  std::vector<std::string> names[kNoSurfaceReasons];
  std::set<int> materials;
  for (const PlacedNode& placement : placements) {
    const auto n = static_cast<std::size_t>(placement.node);
    const int mesh = scene.nodes[n].mesh;
    if (mesh == kNone || placement.portal) continue;
    if (!surfaces.is_surface(placement.node)) {
      names[static_cast<std::size_t>(surfaces.nodes[n])].push_back(node_name(scene, n));
      continue;
    }
    for (const GltfPrimitive& primitive : scene.meshes[static_cast<std::size_t>(mesh)].primitives)
      if (!surfaces.is_material(primitive.material)) materials.insert(primitive.material);
  }
  for (const int material : materials) {
    const auto m = static_cast<std::size_t>(material);
    names[static_cast<std::size_t>(surfaces.materials[m])].push_back(
        scene.materials[m].empty() ? fmt::format("material {}", m) : scene.materials[m]);
  }
  for (std::size_t reason = 1; reason < kNoSurfaceReasons; ++reason) {
    report.left_out[reason] = names[reason].size();
    if (!names[reason].empty())
      report.ignored.push_back(left_out_line(static_cast<NoSurface>(reason), names[reason]));
  }
}

}  // namespace clamor
