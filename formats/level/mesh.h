// mesh.h: the surfaces of a level.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/vec.h"

namespace clamor {

// Triangles that reflect on both sides.
struct Mesh {
  std::vector<Vec3f> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // indices into vertices_m
  std::vector<std::uint16_t> materials;                 // per triangle, index into Level::materials

  bool operator==(const Mesh&) const = default;
};

}  // namespace clamor
