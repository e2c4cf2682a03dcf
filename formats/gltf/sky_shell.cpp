#include "formats/gltf/sky_shell.h"

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "common/bounds.h"

namespace clamor {

namespace {

constexpr double kRound = 0.9;         // least over largest distance of the vertices of a shell
constexpr double kMostVertices = 0.8;  // share of the vertices for which that holds
constexpr std::size_t kRoundVertices = 25;  // fewer make a box, whose corners are as far, too
constexpr double kBoxSize = 2;              // of a box over all else

bool is_black(const Json* colour) {
  if (colour == nullptr || colour->array() == nullptr) return false;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, colour->array()->size()); ++i)
    if (const double* value = (*colour->array())[i].number(); value == nullptr || *value > 0)
      return false;
  return true;
}

// Exporters write a shader of pure emission as a black surface that emits.
bool shines(const Json& material) {
  if (material.find({"extensions", "KHR_materials_unlit"}) != nullptr) return true;
  const bool emits =
      material.find("emissiveTexture") != nullptr ||
      (material.find("emissiveFactor") != nullptr && !is_black(material.find("emissiveFactor")));
  return emits && is_black(material.find({"pbrMetallicRoughness", "baseColorFactor"}));
}

struct Shell {
  Boundsf bounds;
  bool shines = true;
};

bool is_shell(const SceneMesh& mesh, const PlacedTriangles& placed, const Boundsf& bounds,
              const Boundsf& others) {
  const Vec3 low(bounds.low_m), high(bounds.high_m);
  const Vec3 other_low(others.low_m), other_high(others.high_m);
  // The ground may reach below a dome.
  if (!(low.x <= other_low.x && low.z <= other_low.z && high.x >= other_high.x &&
        high.z >= other_high.z && high.y >= other_high.y))
    return false;
  const std::size_t vertices = placed.end_vertex - placed.first_vertex;
  if (vertices < kRoundVertices && !(high.x - low.x >= kBoxSize * (other_high.x - other_low.x) &&
                                     high.z - low.z >= kBoxSize * (other_high.z - other_low.z)))
    return false;
  const double width = std::max(high.x - low.x, high.z - low.z);
  const bool is_half = high.y - low.y < 0.75 * width;
  const Vec3 centre((low.x + high.x) / 2, is_half ? low.y : (low.y + high.y) / 2,
                    (low.z + high.z) / 2);
  double farthest = 0;
  for (std::size_t v = placed.first_vertex; v < placed.end_vertex; ++v)
    farthest = std::max(farthest, length(Vec3(mesh.mesh.vertices_m[v]) - centre));
  std::size_t on_shell = 0;
  for (std::size_t v = placed.first_vertex; v < placed.end_vertex; ++v)
    on_shell += length(Vec3(mesh.mesh.vertices_m[v]) - centre) >= kRound * farthest ? 1 : 0;
  return static_cast<double>(on_shell) >= kMostVertices * static_cast<double>(vertices);
}

}  // namespace

void leave_out_sky_shells(const GltfScene& scene, const SceneSurfaces& surfaces, SceneMesh& mesh,
                          ImportReport& report) {
  std::vector<bool> shining(scene.materials.size() + 1, false);
  for (std::size_t m = 0; m < scene.materials.size(); ++m)
    shining[m] = shines(scene.json.list("materials")[m]);
  if (std::ranges::none_of(shining, std::identity{})) return;

  std::vector<Shell> shells(mesh.placed.size());
  bool is_any_lit = false;
  for (std::size_t p = 0; p < mesh.placed.size(); ++p) {
    const PlacedTriangles& placed = mesh.placed[p];
    for (std::size_t v = placed.first_vertex; v < placed.end_vertex; ++v)
      shells[p].bounds.add(mesh.mesh.vertices_m[v]);
    for (std::size_t t = placed.first_triangle; t < placed.end_triangle && shells[p].shines; ++t)
      shells[p].shines = shining[mesh.mesh.materials[t]];
    is_any_lit |= !shells[p].shines;
  }
  if (!is_any_lit) return;
  Boundsf lit;
  for (const Shell& shell : shells)
    if (!shell.shines) lit.add(shell.bounds);

  std::vector<bool> goes(mesh.placed.size(), false);
  std::vector<std::string> names;
  for (std::size_t p = 0; p < mesh.placed.size(); ++p) {
    const auto node = static_cast<std::size_t>(mesh.placed[p].node);
    goes[p] = shells[p].shines && !surfaces.kept_nodes[node] &&
              is_shell(mesh, mesh.placed[p], shells[p].bounds, lit);
    if (goes[p]) names.push_back(node_name(scene, node));
  }
  if (names.empty()) return;
  report.left_out[static_cast<std::size_t>(NoSurface::kSky)] += names.size();
  report.ignored.push_back(left_out_line(NoSurface::kSky, names));
  remove_placed(mesh, [&](std::size_t p) { return goes[p]; });
}

}  // namespace clamor
