#include "formats/gltf/gltf_mesh_report.h"

#include <fmt/format.h>

#include "common/result.h"
#include "formats/gltf/report_words.h"

namespace clamor {

namespace {

void report_triangles(const SceneMesh& scene, ImportReport& report) {
  std::size_t triangles = scene.mesh.triangles.size();
  for (const Mesh& part : scene.parts) triangles += part.triangles.size();
  report.found.push_back(number_of(triangles, "triangle") + " in " +
                         number_of(scene.meshes, "mesh") + ", placed " +
                         number_of(scene.placements, "time"));
  if (scene.points_or_lines > 0)
    report.ignored.push_back(number_of(scene.points_or_lines, "primitive") + " of points or lines");
  if (scene.degenerate > 0)
    report.ignored.push_back(number_of(scene.degenerate, "triangle") + " without area");
  if (scene.left_over > 0)
    report.warnings.push_back(number_of(scene.left_over, "index") +
                              " at the end of a list make no "
                              "whole triangle; the mesh may be damaged");
}

// Says which meshes are not where their raw vertices are.
void report_poses(const GltfScene& scene, const SceneMesh& mesh, ImportReport& report) {
  const auto names = [&](const std::vector<int>& nodes) {
    std::vector<std::string> all;
    for (const int node : nodes) all.push_back(node_name(scene, static_cast<std::size_t>(node)));
    return first_names(all);
  };
  if (!mesh.skinned.empty())
    report.found.push_back(
        fmt::format("{} where the skin's joints rest: {}; --ignore NAME leaves out one that moves",
                    number_of(mesh.skinned.size(), "skinned mesh"), names(mesh.skinned)));
  if (!mesh.keyed.empty())
    report.found.push_back(fmt::format(
        "{} moved by the default weights of shape keys: {}; --ignore NAME leaves one out",
        number_of(mesh.keyed.size(), "mesh"), names(mesh.keyed)));
  for (const std::string& unposed : mesh.unposed)
    report.warnings.push_back(unposed + "; the mesh is left out");
}

}  // namespace

std::vector<NamedTriangles> named_triangles(const GltfScene& scene, const SceneMesh& mesh) {
  std::vector<NamedTriangles> named;
  for (const PlacedTriangles& placed : mesh.placed) {
    NamedTriangles& one = named.emplace_back();
    one.first = placed.first_triangle;
    one.end = placed.end_triangle;
    for (int at = placed.node; at != kNone;) {
      const GltfNode& node = scene.nodes[static_cast<std::size_t>(at)];
      one.nodes.push_back(node.name);
      at = node.parent;
    }
  }
  return named;
}

void report_mesh(const GltfScene& scene, const SceneMesh& mesh, ImportReport& report) {
  report_triangles(mesh, report);
  report_poses(scene, mesh, report);
}

}  // namespace clamor
