#include "formats/gltf/gltf_marks.h"

#include <algorithm>
#include <array>

#include "common/bounds.h"
#include "formats/gltf/gltf_mesh.h"
#include "formats/level/emitter_spec.h"

namespace clamor {

namespace {

// Custom properties of older exporters hold 0 or 1 for a checkbox.
bool read_flag(JsonFields& fields, const char* key) {
  const Json* value = fields.any(key);
  if (value == nullptr) return false;
  if (value->boolean() != nullptr) return *value->boolean();
  if (value->number() != nullptr && (*value->number() == 0 || *value->number() == 1))
    return *value->number() == 1;
  fields.fail(in_quotes(key) + " must be true or false");
  return false;
}

constexpr double kFlat = 0.5;  // thickness of a mesh over its shorter side, at most

// Unit vectors along the rectangle's sides and its normal.
using Axes = std::array<Vec3, 3>;

// The plane is that of the largest triangle, and a side follows its second-longest edge: the
// longest edge of half a rectangle is the diagonal. Zero vectors without a triangle.
Axes axes_of(const Mesh& mesh) {
  double largest = 0;
  Axes axes{};
  for (const auto& triangle : mesh.triangles) {
    const Vec3 a(mesh.vertices_m[triangle[0]]), b(mesh.vertices_m[triangle[1]]),
        c(mesh.vertices_m[triangle[2]]);
    const Vec3 normal = cross(b - a, c - a);
    if (!(length(normal) > largest)) continue;
    largest = length(normal);
    std::array<Vec3, 3> edges{b - a, c - b, a - c};
    std::sort(edges.begin(), edges.end(),
              [](const Vec3& one, const Vec3& other) { return length(one) < length(other); });
    axes[2] = normalize(normal);
    axes[0] = normalize(edges[1]);
    axes[1] = cross(axes[2], axes[0]);
  }
  return axes;
}

Result<Portal> rectangle_of(const Mesh& mesh) {
  const Axes axes = axes_of(mesh);
  if (axes[2] == Vec3{}) return Error("the mesh of the portal has no area; give it some.");
  const auto [low_m, high_m] = bounds_of(mesh.vertices_m, [&](const Vec3f& vertex) {
    return Vec3(dot(Vec3(vertex), axes[0]), dot(Vec3(vertex), axes[1]), dot(Vec3(vertex), axes[2]));
  });
  const Vec3 half_m = (high_m - low_m) / 2.0, centre_m = (high_m + low_m) / 2.0;
  if (half_m.z > kFlat * std::min(half_m.x, half_m.y))
    return Error("the mesh of the portal is not flat; a portal is a rectangle in an opening.");
  Portal portal;
  portal.centre_m = axes[0] * centre_m.x + axes[1] * centre_m.y + axes[2] * centre_m.z;
  portal.half_u_m = axes[0] * half_m.x;
  portal.half_v_m = axes[1] * half_m.y;
  return portal;
}

Result<Portal> portal_of(const GltfScene& scene, const PlacedNode& placement) {
  if (scene.nodes[static_cast<std::size_t>(placement.node)].mesh != kNone) {
    const auto mesh = placed_mesh(scene, placement);
    if (!mesh.ok()) return mesh.error();
    return rectangle_of(*mesh);
  }
  Portal portal;
  portal.centre_m = Vec3(placement.world[3]);
  portal.half_u_m = Vec3(placement.world[0]) * 0.5;
  portal.half_v_m = Vec3(placement.world[1]) * 0.5;
  return portal;
}

}  // namespace

std::string node_in_words(const GltfScene& scene, std::size_t node) {
  const std::string& name = scene.nodes[node].name;
  return "node " + (name.empty() ? std::to_string(node) : in_quotes(name));
}

Result<NodeMarks> read_marks(const GltfScene& scene, std::size_t node) {
  NodeMarks marks;
  const Json* extras = scene.json.list("nodes")[node].find("extras");
  if (extras == nullptr || extras->object() == nullptr) return marks;
  const std::string where = node_in_words(scene, node);
  JsonFields flat(*extras, where + ": extras");
  marks.probe = read_flag(flat, "clamor_probe");
  marks.portal = read_flag(flat, "clamor_portal");
  marks.movable = read_flag(flat, "clamor_movable");
  if (const auto ok = flat.result(); !ok.ok()) return ok.error();
  if (const Json* clamor = extras->find("clamor")) {
    JsonFields fields(*clamor, where + ": extras: clamor");
    marks.probe |= read_flag(fields, "probe");
    marks.portal |= read_flag(fields, "portal");
    marks.movable |= read_flag(fields, "movable");
    marks.is_baked_closed = read_baked_states(fields, marks.material);
    marks.parts = read_portal_parts(fields);
    fields.any("comment");
    if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  }
  return marks;
}

Result<std::vector<PortalSpec>> read_scene_portals(const GltfScene& scene,
                                                   std::span<const NodeMarks> marks,
                                                   std::span<PlacedNode> placements) {
  std::vector<PortalSpec> portals;
  for (PlacedNode& placement : placements) {
    const auto node = static_cast<std::size_t>(placement.node);
    if (!marks[node].portal) continue;
    placement.portal = true;
    auto portal = portal_of(scene, placement);
    if (!portal.ok()) return portal.error().in(node_in_words(scene, node));
    if (!is_rectangle(*portal) || length(portal->centre_m) > kMaxEmitterCoordinate_m)
      return Error(
          node_in_words(scene, node) +
          ": the portal is no rectangle with sides of 1 cm or more within 1000 km of the level's "
          "middle; scale or repair the node.");
    portal->name = scene.nodes[node].name;
    portal->is_baked_closed = marks[node].is_baked_closed;
    if (portals.size() == kMaxPortals)
      return Error("the scene has more than 1024 portals; mark fewer.");
    portals.push_back({std::move(*portal), marks[node].material, marks[node].parts});
  }
  return portals;
}

Result<std::vector<Vec3>> read_scene_probes(const GltfScene& scene,
                                            std::span<const NodeMarks> marks,
                                            std::span<const PlacedNode> placements) {
  std::vector<Vec3> probes_m;
  for (const PlacedNode& placement : placements) {
    const auto node = static_cast<std::size_t>(placement.node);
    if (!marks[node].probe) continue;
    const Vec3 place_m(placement.world[3]);
    if (!is_finite(place_m) || length(place_m) > kMaxEmitterCoordinate_m)
      return Error(
          node_in_words(scene, node) +
          ": the probe is not within 1000 km of the level's middle; repair the transforms.");
    probes_m.push_back(place_m);
  }
  return probes_m;
}

}  // namespace clamor
