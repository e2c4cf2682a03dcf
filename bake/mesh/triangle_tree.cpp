#include "bake/mesh/triangle_tree.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace clamor {

namespace {

constexpr std::uint32_t kLeaf = 4;

Vec3 nearest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double length2 = dot(along, along);
  return length2 > 0 ? a + along * std::clamp(dot(p - a, along) / length2, 0.0, 1.0) : a;
}

}  // namespace

// The projection of p onto the plane if it lies within the triangle, otherwise the nearest point of
// the three sides.
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 normal = cross(b - a, c - a);
  const double normal2 = dot(normal, normal);
  if (normal2 > 0) {
    const Vec3 foot = p - normal * (dot(p - a, normal) / normal2);
    if (dot(cross(b - a, foot - a), normal) >= 0 && dot(cross(c - b, foot - b), normal) >= 0 &&
        dot(cross(a - c, foot - c), normal) >= 0)
      return foot;
  }
  Vec3 nearest = nearest_on_segment(p, a, b);
  for (const Vec3& other : {nearest_on_segment(p, b, c), nearest_on_segment(p, c, a)})
    if (dot(other - p, other - p) < dot(nearest - p, nearest - p)) nearest = other;
  return nearest;
}

TriangleTree::TriangleTree(const Mesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (order_.empty()) return;
  nodes_.reserve(order_.size());
  build(0, static_cast<std::uint32_t>(order_.size()));
}

void TriangleTree::build(std::uint32_t first, std::uint32_t last) {
  const auto thrice_centre = [this](std::uint32_t triangle) {
    const auto& corners = mesh_.triangles[triangle];
    return mesh_.vertices_m[corners[0]] + mesh_.vertices_m[corners[1]] +
           mesh_.vertices_m[corners[2]];
  };
  Boundsf box;
  Boundsf centres;
  for (std::uint32_t i = first; i < last; ++i) {
    for (const std::uint32_t corner : mesh_.triangles[order_[i]]) box.add(mesh_.vertices_m[corner]);
    centres.add(thrice_centre(order_[i]));
  }
  const std::size_t node = nodes_.size();
  nodes_.push_back({box, first, last - first <= kLeaf ? last - first : 0});
  if (last - first <= kLeaf) return;

  const Vec3f spread = centres.high_m - centres.low_m;
  int axis = spread.y > spread.x ? 1 : 0;
  if (spread.z > spread[axis]) axis = 2;
  const std::uint32_t middle = first + (last - first) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                   [&](std::uint32_t a, std::uint32_t b) {
                     const float at_a = thrice_centre(a)[axis], at_b = thrice_centre(b)[axis];
                     return at_a != at_b ? at_a < at_b : a < b;
                   });
  build(first, middle);
  nodes_[node].first = static_cast<std::uint32_t>(nodes_.size());
  build(middle, last);
}

std::optional<TriangleTree::Nearest> TriangleTree::nearest(const Vec3& point_m, double within_m,
                                                           const Accepts& accepts,
                                                           std::size_t max_visits,
                                                           std::size_t* visits) const {
  std::optional<Nearest> best;
  std::size_t visited = 0;
  double best_m2 = within_m * within_m;
  std::array<std::uint32_t, 64> waiting;  // one node per level at most
  std::size_t depth = 0;
  if (!nodes_.empty()) waiting[depth++] = 0;
  while (depth > 0 && visited < max_visits) {
    ++visited;
    const std::uint32_t index = waiting[--depth];
    const Node& node = nodes_[index];
    if (node.box.distance2_m2(point_m) > best_m2) continue;
    if (node.count == 0) {
      std::uint32_t near = index + 1, far = node.first;
      if (nodes_[far].box.distance2_m2(point_m) < nodes_[near].box.distance2_m2(point_m))
        std::swap(near, far);
      waiting[depth++] = far;
      waiting[depth++] = near;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count && visited < max_visits; ++i) {
      ++visited;
      const std::uint32_t triangle = order_[i];
      const auto& corners = mesh_.triangles[triangle];
      const Vec3 on = nearest_on_triangle(point_m, Vec3(mesh_.vertices_m[corners[0]]),
                                          Vec3(mesh_.vertices_m[corners[1]]),
                                          Vec3(mesh_.vertices_m[corners[2]]));
      const double apart_m2 = dot(on - point_m, on - point_m);
      if (apart_m2 > best_m2 || (apart_m2 == best_m2 && best && triangle > best->triangle))
        continue;
      if (accepts && !accepts(triangle, on)) continue;
      best_m2 = apart_m2;
      best = Nearest{triangle, on, std::sqrt(apart_m2)};
    }
  }
  if (visits != nullptr) *visits += visited;
  return best;
}

}  // namespace clamor
