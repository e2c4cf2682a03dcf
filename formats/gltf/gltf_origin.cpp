#include "formats/gltf/gltf_origin.h"

#include <algorithm>
#include <map>
#include <optional>

#include "common/bounds.h"
#include "formats/gltf/gltf_accessor.h"
#include "formats/level/level_origin.h"

namespace clamor {

namespace {

// The middle of some of a mesh's vertices, in its own coordinates.
std::optional<Vec3> middle_of(const GltfScene& scene, std::size_t mesh) {
  constexpr std::size_t kVertices = 64;  // of each primitive
  Bounds bounds;
  for (const GltfPrimitive& primitive : scene.meshes[mesh].primitives) {
    if (primitive.positions() == kNone) continue;
    const auto positions = GltfReader::open(scene, primitive.positions(), 3);
    if (!positions.ok()) continue;  // build_mesh() says so
    const std::size_t step = std::max<std::size_t>(1, positions->count() / kVertices);
    for (std::size_t i = 0; i < positions->count(); i += step) {
      const auto p = positions->at(i);
      if (const Vec3 place(p[0], p[1], p[2]); is_finite(place)) bounds.add(place);
    }
  }
  if (bounds.is_empty()) return std::nullopt;
  return (bounds.low_m + bounds.high_m) / 2.0;
}

}  // namespace

Vec3 origin_of(const GltfScene& scene, const std::vector<PlacedNode>& placements) {
  std::map<int, std::optional<Vec3>> middles;  // by mesh
  std::vector<double> places_m[3];
  for (const PlacedNode& placement : placements) {
    const int mesh = scene.nodes[static_cast<std::size_t>(placement.node)].mesh;
    if (mesh == kNone) continue;
    auto [known, is_new] = middles.try_emplace(mesh);
    if (is_new) known->second = middle_of(scene, static_cast<std::size_t>(mesh));
    if (!known->second) continue;
    const Vec3 place_m(placement.world * glm::dvec4(*known->second, 1));
    if (!is_finite(place_m)) continue;
    for (int axis = 0; axis < 3; ++axis) places_m[axis].push_back(place_m[axis]);
  }
  if (places_m[0].empty()) return Vec3(0);
  Vec3 middle_m;
  for (int axis = 0; axis < 3; ++axis) {
    const auto half =
        places_m[axis].begin() + static_cast<std::ptrdiff_t>(places_m[axis].size() / 2);
    std::nth_element(places_m[axis].begin(), half, places_m[axis].end());
    middle_m[axis] = *half;
  }
  return level_origin_m(middle_m);
}

void subtract_origin(const GltfScene& scene, std::vector<PlacedNode>& placements,
                     MovableNodes& movable) {
  const glm::dvec4 origin_m(scene.origin_m, 0);
  for (PlacedNode& placement : placements) placement.world[3] -= origin_m;
  for (auto& part : movable.parts) part.world[3] -= origin_m;
}

}  // namespace clamor
