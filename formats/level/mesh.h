// mesh.h: the surfaces of a level.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/bounds.h"
#include "common/vec.h"

namespace clamor {

// Triangles that reflect on both sides.
struct Mesh {
  std::vector<Vec3f> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // indices into vertices_m
  std::vector<std::uint16_t> materials;                 // per triangle, index into Level::materials

  bool operator==(const Mesh&) const = default;
};

// Bounds of the triangles. Vertices that no triangle uses do not count.
inline Boundsf bounds_of(const Mesh& mesh) {
  Boundsf bounds;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) bounds.add(mesh.vertices_m[corner]);
  return bounds;
}

}  // namespace clamor
