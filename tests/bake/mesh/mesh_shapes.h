// mesh_shapes.h: test meshes and a distance between surfaces.
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>

#include "bake/mesh/mesh_preparation.h"
#include "bake/mesh/triangle_tree.h"
#include "common/random.h"
#include "formats/gltf/level_import.h"
#include "tests/build_paths.h"
#include "tests/rooms.h"

namespace clamor::testing {

inline double whole_area_m2(const Mesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += area_m2(mesh, t);
  return sum;
}

inline std::vector<double> material_areas_m2(const Mesh& mesh, std::size_t materials) {
  std::vector<double> areas(materials, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    areas[mesh.materials[t]] += area_m2(mesh, t);
  return areas;
}

inline void add(Mesh& mesh, const Mesh& more) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.insert(mesh.vertices_m.end(), more.vertices_m.begin(), more.vertices_m.end());
  for (const auto& triangle : more.triangles)
    mesh.triangles.push_back({triangle[0] + first, triangle[1] + first, triangle[2] + first});
  mesh.materials.insert(mesh.materials.end(), more.materials.begin(), more.materials.end());
}

// Long narrow triangles of one metre by a millimetre that cross at their middles: all their boxes
// overlap there.
inline Mesh crossing_slivers(std::uint32_t count) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const RandomBits bits = philox(11, {i, 0, 0, 0});
    const Vec3 along = normalize(Vec3(unit(bits[0]), unit(bits[1]), unit(bits[2])) - Vec3(0.5));
    for (const Vec3& corner : {-0.5 * along, 0.5 * along, 0.5 * along + Vec3(0, 1e-3, 0)})
      mesh.vertices_m.push_back(Vec3f(corner));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    mesh.materials.push_back(0);
  }
  return mesh;
}

// Samples the surface at(u, v) over the unit square with `across` x `up` cells of two triangles.
inline Mesh patch(std::uint32_t across, std::uint32_t up,
                  const std::function<Vec3(double u, double v)>& at, std::uint16_t material = 0) {
  Mesh mesh;
  for (std::uint32_t j = 0; j <= up; ++j)
    for (std::uint32_t i = 0; i <= across; ++i)
      mesh.vertices_m.emplace_back(
          at(static_cast<double>(i) / across, static_cast<double>(j) / up));
  for (std::uint32_t j = 0; j < up; ++j)
    for (std::uint32_t i = 0; i < across; ++i) {
      const std::uint32_t corner = j * (across + 1) + i, above = corner + across + 1;
      mesh.triangles.push_back({corner, corner + 1, above + 1});
      mesh.triangles.push_back({corner, above + 1, above});
    }
  mesh.materials.assign(mesh.triangles.size(), material);
  return mesh;
}

// The walls of a box at the origin, each of cells x cells and displaced by `moved`. Their vertices
// are not shared; welding joins them.
inline Mesh fine_box(
    const Vec3& size_m, std::uint32_t cells,
    const std::function<Vec3(const Vec3&)>& moved = [](const Vec3& p) { return p; }) {
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {0.0, 1.0})
      add(mesh, patch(
                    cells, cells,
                    [&](double u, double v) {
                      Vec3 p(0);
                      p[axis] = side * size_m[axis];
                      p[(axis + 1) % 3] = u * size_m[(axis + 1) % 3];
                      p[(axis + 2) % 3] = v * size_m[(axis + 2) % 3];
                      return moved(p);
                    },
                    static_cast<std::uint16_t>(2 * axis + (side > 0 ? 1 : 0))));
  return mesh;
}

// Random triangles on a small lattice: many coincide, many have no area, and most edges have far
// more than two faces.
inline Mesh random_soup(std::uint64_t seed, std::uint32_t triangles, std::uint32_t lattice) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const RandomBits corners = philox(seed, {i, 0, 0, 0}), material = philox(seed, {i, 1, 0, 0});
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t place = corners[c] % (lattice * lattice * lattice);
      mesh.vertices_m.emplace_back(place % lattice, place / lattice % lattice,
                                   place / lattice / lattice);
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    mesh.materials.push_back(static_cast<std::uint16_t>(material[0] % 3));
  }
  return mesh;
}

// One-sided Hausdorff distance, estimated by points spread evenly over the area of `from`.
inline double furthest_m(const Mesh& from, const Mesh& to, std::uint32_t samples) {
  const TriangleTree tree(to);
  const double all_m2 = whole_area_m2(from);
  double furthest = 0, below_m2 = 0;
  std::size_t t = 0;
  for (std::uint32_t i = 0; i < samples; ++i) {
    const double wanted_m2 = (i + 0.5) / samples * all_m2;
    while (t + 1 < from.triangles.size() && below_m2 + area_m2(from, t) < wanted_m2)
      below_m2 += area_m2(from, t++);
    const RandomBits bits = philox(11, {i, 0, 0, 0});
    const double u = std::sqrt(unit(bits[0])), v = unit(bits[1]);
    const auto& corners = from.triangles[t];
    const Vec3 a(from.vertices_m[corners[0]]), b(from.vertices_m[corners[1]]),
        c(from.vertices_m[corners[2]]);
    const Vec3 point = a * (1 - u) + b * (u * (1 - v)) + c * (u * v);
    furthest = std::max(furthest, tree.nearest(point, 1e9)->distance_m);
  }
  return furthest;
}

// A level from the shared folder, or nothing if this machine does not have it.
inline std::optional<Level> real_level(const std::string& name) {
  const std::string path = shared_level(name);
  if (!std::filesystem::exists(path)) return std::nullopt;
  auto imported = import_level(path, {});
  if (!imported.ok()) return std::nullopt;
  return std::move(imported->level);
}

}  // namespace clamor::testing
