#include "formats/gltf/emitter_props.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "common/maths.h"

namespace clamor {

namespace {

constexpr double kSmallProp_m = 0.5;
// No room is narrower than this in two directions and shorter than that in the third.
constexpr double kNarrowRoom_m = 2, kLongProp_m = 6;
constexpr std::size_t kMaxObjectNodes = 1000, kMaxPropTriangles = 200'000;
constexpr std::size_t kDirections = 48;
constexpr double kSurrounded = 0.9;  // share of the directions that hit the prop
constexpr double kOnBase_m = 0.02;   // an emitter at the foot of its prop
constexpr std::size_t kShownProps = 3;

// Directions spread evenly over the sphere (a Fibonacci lattice).
std::array<Vec3, kDirections> directions() {
  std::array<Vec3, kDirections> all;
  for (std::size_t i = 0; i < kDirections; ++i) {
    const double y = 1 - (2 * static_cast<double>(i) + 1) / kDirections;
    const double turns = static_cast<double>(i) * (3 - std::sqrt(5.0)) / 2;
    const SinCos turn = sin_cos_of_turn(static_cast<float>(turns - std::floor(turns)));
    const double radius = std::sqrt(1 - y * y);
    all[i] = {radius * static_cast<double>(turn.cos), y, radius * static_cast<double>(turn.sin)};
  }
  return all;
}

// Distance to a triangle along a ray, or infinity. T. Möller, B. Trumbore. Fast, minimum storage
// ray/triangle intersection. J. Graphics Tools 2, 1997.
double hit_m(const Vec3& from, const Vec3& ray, const Vec3& a, const Vec3& b, const Vec3& c) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const Vec3 ab = b - a, ac = c - a, p = cross(ray, ac);
  const double determinant = dot(ab, p);
  if (determinant == 0) return kNever;
  const Vec3 s = from - a, q = cross(s, ab);
  const double u = dot(s, p) / determinant, v = dot(ray, q) / determinant;
  if (u < 0 || v < 0 || u + v > 1) return kNever;
  const double distance = dot(ac, q) / determinant;
  return distance > 1e-6 ? distance : kNever;
}

std::array<double, 3> sorted_sides(const Boundsf& bounds) {
  const Vec3 size = Vec3(bounds.high_m) - Vec3(bounds.low_m);
  std::array<double, 3> sides = {size.x, size.y, size.z};
  std::sort(sides.begin(), sides.end());
  return sides;
}

}  // namespace

EmitterProps::EmitterProps(const GltfScene& scene, const SceneSurfaces& surfaces,
                           const SceneMesh& mesh)
    : scene_(scene), surfaces_(surfaces), mesh_(mesh) {
  first_of_.assign(scene.nodes.size(), mesh.placed.size());
  bounds_.resize(mesh.placed.size());
  for (std::size_t p = mesh.placed.size(); p-- > 0;) {
    const PlacedTriangles& placed = mesh.placed[p];
    first_of_[static_cast<std::size_t>(placed.node)] = p;
    for (std::size_t v = placed.first_vertex; v < placed.end_vertex; ++v)
      bounds_[p].add(mesh.mesh.vertices_m[v]);
    level_bounds_.add(bounds_[p]);
  }
}

// The first placement of each node from `node` down, without those that are kept; empty if there
// are too many for a prop.
std::vector<std::size_t> EmitterProps::object_below(int node) const {
  std::vector<std::size_t> object;
  std::vector<int> stack = {node};
  for (std::size_t visited = 0; !stack.empty(); ++visited) {
    if (visited > kMaxObjectNodes) return {};
    const auto n = static_cast<std::size_t>(stack.back());
    stack.pop_back();
    if (first_of_[n] < mesh_.placed.size() && !surfaces_.kept_nodes[n])
      object.push_back(first_of_[n]);
    stack.insert(stack.end(), scene_.nodes[n].children.begin(), scene_.nodes[n].children.end());
  }
  return object;
}

bool EmitterProps::is_prop(std::span<const std::size_t> object, const Vec3& place_m,
                           double longest_m) const {
  Boundsf bounds;
  std::size_t triangles = 0;
  for (const std::size_t p : object) {
    bounds.add(bounds_[p]);
    triangles += mesh_.placed[p].end_triangle - mesh_.placed[p].first_triangle;
  }
  if (triangles == 0 || triangles > kMaxPropTriangles ||
      bounds.distance2_m2(place_m) > kOnBase_m * kOnBase_m)
    return false;
  const auto sides = sorted_sides(bounds);
  if (sides[2] > longest_m || sides[1] > kNarrowRoom_m) return false;

  std::size_t hits = 0, back_faces = 0, upward = 0, upward_hits = 0;
  for (const Vec3& ray : directions()) {
    double nearest_m = std::numeric_limits<double>::infinity();
    bool is_back = false;
    for (const std::size_t p : object)
      for (std::size_t t = mesh_.placed[p].first_triangle; t < mesh_.placed[p].end_triangle; ++t) {
        const auto& [i, j, k] = mesh_.mesh.triangles[t];
        const Vec3 a(mesh_.mesh.vertices_m[i]), b(mesh_.mesh.vertices_m[j]),
            c(mesh_.mesh.vertices_m[k]);
        const double distance_m = hit_m(place_m, ray, a, b, c);
        if (!(distance_m < nearest_m)) continue;
        nearest_m = distance_m;
        is_back = dot(cross(b - a, c - a), ray) > 0;
      }
    const bool is_hit = std::isfinite(nearest_m);
    hits += is_hit ? 1 : 0;
    back_faces += is_hit && is_back ? 1 : 0;
    upward += ray.y > 0 ? 1 : 0;
    upward_hits += is_hit && ray.y > 0 ? 1 : 0;
  }
  const auto most_of = [](std::size_t part, std::size_t all) {
    return static_cast<double>(part) >= kSurrounded * static_cast<double>(all);
  };
  const bool is_on_base = place_m.y - static_cast<double>(bounds.low_m.y) < kOnBase_m;
  if (!most_of(hits, kDirections) && !(is_on_base && most_of(upward_hits, upward))) return false;
  if (sides[2] <= kSmallProp_m) return true;
  // A level of one small room has nothing outside of it either, but its faces point inwards.
  const bool is_whole_level = bounds.distance2_m2(Vec3(level_bounds_.low_m)) == 0 &&
                              bounds.distance2_m2(Vec3(level_bounds_.high_m)) == 0;
  return !is_whole_level || most_of(back_faces, hits);
}

// Adds all instances of the nodes.
void EmitterProps::add(std::span<const std::size_t> object, const std::string& emitter) {
  for (std::size_t p : object)
    for (const int node = mesh_.placed[p].node;
         p < mesh_.placed.size() && mesh_.placed[p].node == node; ++p)
      emitters_.try_emplace(p, emitter);
}

void EmitterProps::add_objects(std::span<const Emitter> emitters, std::span<const int> nodes,
                               const std::function<bool(const std::string&)>& moves) {
  for (std::size_t i = 0; i < emitters.size(); ++i) {
    // The instances of a node are alike, so the first stands for all.
    if ((i > 0 && nodes[i] == nodes[i - 1]) || moves(emitters[i].name)) continue;
    std::vector<std::vector<std::size_t>> objects = {object_below(nodes[i])};
    if (const int parent = scene_.nodes[static_cast<std::size_t>(nodes[i])].parent;
        parent != kNone) {
      const std::size_t own = first_of_[static_cast<std::size_t>(parent)];
      if (own < mesh_.placed.size() && !surfaces_.kept_nodes[static_cast<std::size_t>(parent)])
        objects.push_back({own});
      objects.push_back(object_below(parent));
    }
    const auto object = std::ranges::find_if(objects, [&](const auto& one) {
      return is_prop(one, emitters[i].position_m, kLongProp_m);
    });
    if (object != objects.end()) add(*object, emitters[i].name);
  }
}

void EmitterProps::add_small(std::span<const Emitter> emitters) {
  std::vector<std::size_t> by_x(emitters.size());
  std::iota(by_x.begin(), by_x.end(), std::size_t{0});
  std::ranges::sort(by_x, {}, [&](std::size_t i) { return emitters[i].position_m.x; });
  for (std::size_t p = 0; p < bounds_.size(); ++p) {
    const int node = mesh_.placed[p].node;
    if (sorted_sides(bounds_[p])[2] > kSmallProp_m || emitters_.contains(p) ||
        surfaces_.kept_nodes[static_cast<std::size_t>(node)])
      continue;
    const auto x = [&](std::size_t i) { return emitters[i].position_m.x; };
    const double low = static_cast<double>(bounds_[p].low_m.x) - kOnBase_m,
                 high = static_cast<double>(bounds_[p].high_m.x) + kOnBase_m;
    for (auto it = std::ranges::lower_bound(by_x, low, {}, x); it != by_x.end() && x(*it) <= high;
         ++it) {
      if (!is_prop(std::span(&p, 1), emitters[*it].position_m, kSmallProp_m)) continue;
      emitters_.emplace(p, emitters[*it].name);
      break;
    }
  }
}

void EmitterProps::leave_out(SceneMesh& mesh, ImportReport& report) const {
  if (emitters_.empty()) return;
  std::map<int, std::string> by_node;
  for (const auto& [p, emitter] : emitters_) by_node.try_emplace(mesh_.placed[p].node, emitter);
  report.left_out[static_cast<std::size_t>(NoSurface::kPropOfEmitter)] = by_node.size();
  std::size_t shown = 0;
  for (const auto& [node, emitter] : by_node) {
    if (shown++ == kShownProps) break;
    const std::string name = node_name(scene_, static_cast<std::size_t>(node));
    report.ignored.push_back(
        fmt::format("prop '{}', which surrounds its emitter '{}' and would muffle it; --keep '{}' "
                    "makes it a surface",
                    name, emitter, name));
  }
  if (by_node.size() > kShownProps)
    report.ignored.push_back(
        fmt::format("{} more props that surround their emitters", by_node.size() - kShownProps));
  remove_placed(mesh, [&](std::size_t p) { return emitters_.contains(p); });
}

}  // namespace clamor
