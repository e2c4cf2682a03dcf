#include "bake/mesh/vertex_welding.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "bake/mesh/mesh_preparation.h"
#include "common/bounds.h"

namespace clamor {

namespace {

constexpr std::uint32_t kNone = 0xffffffff;
constexpr double kCell = 4;  // in welding distances

// Spatial hash of the representatives. Cells with equal hashes share a list, which costs time but
// not correctness.
class Grid {
 public:
  Grid(const Mesh& mesh, std::size_t vertices, double distance_m)
      : vertices_m_(mesh.vertices_m), distance_m_(distance_m), cell_m_(kCell * distance_m) {
    std::size_t size = 16;
    while (size < 2 * vertices) size *= 2;
    first_.assign(size, kNone);
    next_.assign(vertices_m_.size(), kNone);
  }

  // The nearest representative within the distance (the lowest index among equals), or kNone.
  std::uint32_t find(std::uint32_t vertex) const {
    const Vec3 at(vertices_m_[vertex]);
    std::array<std::int64_t, 3> low, high;
    for (int axis = 0; axis < 3; ++axis) {
      const auto place = static_cast<std::size_t>(axis);
      low[place] = cell(at[axis] - distance_m_);
      high[place] = cell(at[axis] + distance_m_);
    }
    std::uint32_t nearest = kNone;
    double nearest_m2 = distance_m_ * distance_m_;
    for (std::int64_t x = low[0]; x <= high[0]; ++x)
      for (std::int64_t y = low[1]; y <= high[1]; ++y)
        for (std::int64_t z = low[2]; z <= high[2]; ++z)
          for (std::uint32_t i = first_[slot(x, y, z)]; i != kNone; i = next_[i]) {
            const Vec3 apart = Vec3(vertices_m_[i]) - at;
            const double apart_m2 = dot(apart, apart);
            if (apart_m2 > nearest_m2 || (apart_m2 == nearest_m2 && i > nearest)) continue;
            nearest_m2 = apart_m2;
            nearest = i;
          }
    return nearest;
  }

  void add(std::uint32_t vertex) {
    const Vec3 at(vertices_m_[vertex]);
    std::uint32_t& first = first_[slot(cell(at.x), cell(at.y), cell(at.z))];
    next_[vertex] = first;
    first = vertex;
  }

 private:
  std::int64_t cell(double coordinate_m) const {
    return static_cast<std::int64_t>(std::floor(coordinate_m / cell_m_));
  }
  std::size_t slot(std::int64_t x, std::int64_t y, std::int64_t z) const {
    std::uint64_t hash = 0;
    for (const std::int64_t cell : {x, y, z}) {
      hash = (hash ^ static_cast<std::uint64_t>(cell)) * 0x9e3779b97f4a7c15u;
      hash ^= hash >> 29;
    }
    return static_cast<std::size_t>(hash ^ (hash >> 32)) & (first_.size() - 1);
  }

  const std::vector<Vec3f>& vertices_m_;
  double distance_m_, cell_m_;
  std::vector<std::uint32_t> first_, next_;  // linked lists: heads per slot, links per vertex
};

}  // namespace

double weld_distance_m(const Mesh& mesh, double rounding_m) {
  if (mesh.triangles.empty()) return 1e-4;
  const Boundsf bounds = bounds_of(mesh);
  double largest_m = 0;
  for (int axis = 0; axis < 3; ++axis)
    largest_m = std::max({largest_m, std::abs(static_cast<double>(bounds.low_m[axis])),
                          std::abs(static_cast<double>(bounds.high_m[axis]))});
  const double single_m = 4 * 0x1p-23 * largest_m;
  // Transforms round on top of quantisation.
  const double quantised_m = rounding_m <= kMaxRounding_m ? rounding_m + single_m : single_m;
  // All vertices at the origin: any distance works.
  return std::max({std::min(1e-4, 1e-5 * bounds.diagonal_m()), quantised_m, 1e-30});
}

Welding weld_vertices(const Mesh& mesh, double distance_m) {
  Welding welding;
  std::vector<bool> used(mesh.vertices_m.size(), false);
  for (const auto& triangle : mesh.triangles)
    for (const auto corner : triangle) used[corner] = true;
  Grid grid(mesh, static_cast<std::size_t>(std::count(used.begin(), used.end(), true)), distance_m);
  welding.representative.resize(mesh.vertices_m.size());
  for (std::uint32_t vertex = 0; vertex < mesh.vertices_m.size(); ++vertex) {
    welding.representative[vertex] = vertex;
    if (!used[vertex]) continue;
    const std::uint32_t found = grid.find(vertex);
    if (found == kNone) {
      grid.add(vertex);
      continue;
    }
    welding.representative[vertex] = found;
    ++welding.welded;
  }
  return welding;
}

}  // namespace clamor
