#include "formats/gltf/gltf_movable.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>

#include "common/text.h"
#include "formats/gltf/report_words.h"
#include "formats/gltf/tool_losses.h"
#include "formats/level/level_origin.h"
#include "formats/level/name_match.h"

namespace clamor {

namespace {

// The rotation and translation of a transform: its axes are made orthogonal and of unit length. A
// reflection stays in the mesh.
glm::dmat4 pivot_of(const glm::dmat4& world) {
  glm::dvec3 x(world[0]), y(world[1]);
  glm::dmat4 pivot(1.0);
  pivot[3] = world[3];
  if (!(glm::length(x) > 0)) return pivot;
  x = glm::normalize(x);
  y -= glm::dot(x, y) * x;
  if (!(glm::length(y) > 0)) return pivot;
  y = glm::normalize(y);
  pivot[0] = glm::dvec4(x, 0);
  pivot[1] = glm::dvec4(y, 0);
  pivot[2] = glm::dvec4(glm::cross(x, y), 0);
  return pivot;
}

class MovableSearch {
 public:
  MovableSearch(const GltfScene& scene, const std::vector<std::string>& globs)
      : scene_(scene), globs_(globs), is_used_(globs.size(), false) {}

  Result<MovableNodes> run() {
    struct Visit {
      int node, part;
      glm::dmat4 parent;
    };
    MovableNodes found;
    found.part_of.assign(scene_.nodes.size(), kNone);
    found.marks.resize(scene_.nodes.size());
    std::vector<Visit> stack;
    for (auto it = scene_.roots.rbegin(); it != scene_.roots.rend(); ++it)
      stack.push_back({*it, kNone, glm::dmat4(1.0)});
    while (!stack.empty()) {
      Visit visit = stack.back();
      stack.pop_back();
      const auto n = static_cast<std::size_t>(visit.node);
      const glm::dmat4 world = visit.parent * scene_.nodes[n].local;
      const bool is_listed = matches_glob(scene_.nodes[n].name);
      auto marks = read_marks(scene_, n);
      if (!marks.ok()) return marks.error();
      found.marks[n] = std::move(*marks);
      if ((is_listed || found.marks[n].movable) && visit.part == kNone) {
        visit.part = static_cast<int>(found.parts.size());
        found.parts.push_back({visit.node, pivot_of(world)});
        if (!(length(Vec3(world[3])) <= kMaxWorldCoordinate_m))
          return Error(
              fmt::format("node {} '{}': a movable part must be within 100 000 km of the origin; "
                          "repair the transforms.",
                          n, scene_.nodes[n].name));
        if (found.parts.size() > kMaxMovableParts)
          return Error(fmt::format("has more than {} movable nodes; join those that move together.",
                                   kMaxMovableParts));
      }
      found.part_of[n] = visit.part;
      const auto& children = scene_.nodes[n].children;
      for (auto it = children.rbegin(); it != children.rend(); ++it)
        stack.push_back({*it, visit.part, world});
    }
    return found;
  }

  void warn_of_unused(ImportReport& report) const {
    std::vector<std::string> names;
    for (const GltfNode& node : scene_.nodes)
      if (!node.name.empty()) names.push_back(node.name);
    for (std::size_t g = 0; g < globs_.size(); ++g)
      if (!is_used_[g])
        report.warnings.push_back(fmt::format(
            "the sidecar's movable '{}' matches no node; {}", globs_[g],
            names.empty() ? "none has a name"
                          : "the nearest is " + in_quotes(nearest_name(globs_[g], names))));
  }

 private:
  bool matches_glob(const std::string& name) {
    bool matches = false;
    for (std::size_t g = 0; g < globs_.size(); ++g)
      if (glob_matches(globs_[g], name)) matches = is_used_[g] = true;
    return matches;
  }

  const GltfScene& scene_;
  const std::vector<std::string>& globs_;
  std::vector<bool> is_used_;  // by glob
};

// Quantisers write the transform of a mesh's integers into its node, whose origin then is no longer
// where its author put it. Other tools leave the middle of the mesh there when they unpack it.
bool has_quantised_pivot(const GltfScene& scene, std::size_t node, const Mesh& part) {
  if (scene.nodes[node].mesh == kNone) return false;
  for (const auto& primitive :
       scene.meshes[static_cast<std::size_t>(scene.nodes[node].mesh)].primitives)
    if (const int positions = primitive.positions();
        positions != kNone &&
        scene.accessors[static_cast<std::size_t>(positions)].component_type != kGltfFloat)
      return true;
  const std::string generator = generator_of(scene.json);
  if (!generator.starts_with("glTF-Transform") && !generator.starts_with("gltfpack")) return false;
  constexpr double kMiddle = 1e-3;  // of the diagonal
  const Boundsf bounds = bounds_of(part);
  return length(Vec3(bounds.low_m) + Vec3(bounds.high_m)) < 2 * kMiddle * bounds.diagonal_m();
}

}  // namespace

Result<MovableNodes> find_movable_nodes(const GltfScene& scene,
                                        const std::vector<std::string>& globs,
                                        ImportReport& report) {
  MovableSearch search(scene, globs);
  auto found = search.run();
  if (found.ok()) search.warn_of_unused(report);
  return found;
}

std::vector<MovablePart> movable_parts(const GltfScene& scene, const MovableNodes& movable,
                                       std::vector<Mesh> meshes, ImportReport& report) {
  std::vector<MovablePart> parts;
  std::size_t triangles = 0;
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    const auto& [node, world] = movable.parts[p];
    const std::string& name = scene.nodes[static_cast<std::size_t>(node)].name;
    if (meshes[p].triangles.empty()) {
      report.warnings.push_back(
          fmt::format("the movable node {} '{}' has no triangles; it is left out", node, name));
      continue;
    }
    triangles += meshes[p].triangles.size();
    if (has_quantised_pivot(scene, static_cast<std::size_t>(node), meshes[p]))
      report.warnings.push_back(fmt::format(
          "the movable part '{0}' turns about ({1:.4g}, {2:.4g}, {3:.4g}), where a tool that "
          "quantises meshes has moved its origin; mark a node above it as movable, at its hinge, "
          "or leave '{0}' out when you quantise",
          name, world[3].x + scene.origin_m.x, world[3].y + scene.origin_m.y,
          world[3].z + scene.origin_m.z));
    const PartPose pose{Vec3(world[3]), Rotation(glm::quat_cast(glm::dmat3(world)))};
    parts.push_back({name, std::move(meshes[p]), normalized(pose)});
  }
  if (!parts.empty())
    report.found.push_back(number_of(parts.size(), "movable part") + " with " +
                           number_of(triangles, "triangle"));
  return parts;
}

}  // namespace clamor
