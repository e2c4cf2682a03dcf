// box_mesh.h: faces and boxes of triangles, and materials for them.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "common/material.h"
#include "formats/level/mesh.h"

namespace clamor::testing {

// A planar face with these corners in order: two triangles.
inline void add_quad(Mesh& mesh, const std::array<Vec3f, 4>& corners_m,
                     std::uint16_t material = 0) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.insert(mesh.vertices_m.end(), corners_m.begin(), corners_m.end());
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
  mesh.materials.insert(mesh.materials.end(), 2, material);
}

// A wall across a box of `size_m` at x = `x_m`, from floor to ceiling.
inline void add_wall_across(Mesh& mesh, double x_m, const Vec3& size_m, std::uint16_t material) {
  add_quad(mesh,
           {Vec3f(x_m, 0, 0), Vec3f(x_m, size_m.y, 0), Vec3f(x_m, size_m.y, size_m.z),
            Vec3f(x_m, 0, size_m.z)},
           material);
}

// A closed box from the origin to `size_m`: faces -x +x -y +y -z +z, two triangles each.
// `materials` are per face.
inline Mesh box(const Vec3& size_m, const std::array<std::uint16_t, 6>& materials = {}) {
  Mesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices_m.push_back(Vec3f((corner & 1) ? size_m.x : 0, (corner & 2) ? size_m.y : 0,
                                    (corner & 4) ? size_m.z : 0));
  constexpr std::uint32_t kFaces[6][4] = {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1},
                                          {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};
  for (std::size_t f = 0; f < 6; ++f) {
    mesh.triangles.push_back({kFaces[f][0], kFaces[f][1], kFaces[f][2]});
    mesh.triangles.push_back({kFaces[f][0], kFaces[f][2], kFaces[f][3]});
    mesh.materials.insert(mesh.materials.end(), 2, materials[f]);
  }
  return mesh;
}

// A floor of `count` triangles, two per square metre.
inline Mesh many_triangles(std::uint32_t count) {
  Mesh mesh;
  const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(count / 2.0)));
  for (std::uint32_t z = 0; z <= side; ++z)
    for (std::uint32_t x = 0; x <= side; ++x)
      mesh.vertices_m.push_back(Vec3f(static_cast<float>(x), 0, static_cast<float>(z)));
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t corner = i / 2 / side * (side + 1) + i / 2 % side;
    if (i % 2 == 0)
      mesh.triangles.push_back({corner, corner + 1, corner + side + 1});
    else
      mesh.triangles.push_back({corner + 1, corner + side + 2, corner + side + 1});
  }
  mesh.materials.assign(count, 0);
  return mesh;
}

inline Material uniform_material(float absorption, float scattering = 1, float phong = 0) {
  Material material;
  material.name = "wall";
  material.absorption = same_in_all_bands(absorption);
  material.scattering = same_in_all_bands(scattering);
  material.phong = same_in_all_bands(phong);
  return material;
}

}  // namespace clamor::testing
