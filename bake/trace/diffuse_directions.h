// diffuse_directions.h: sample directions for random walks with diffuse reflections.
//
// The level report uses them before the bake.
#pragma once

#include <cmath>

#include "common/random.h"
#include "common/sphere.h"
#include "common/vec.h"

namespace clamor {

// A direction sampled from Lambert's cosine law around `normal`.
inline Vec3 diffuse_direction(const Vec3& normal, const RandomBits& bits) {
  const Vec3 local = on_sphere(std::sqrt(unit_above_zero(bits[0])), unit(bits[1]));
  const Basis basis = basis_around(normal);
  return basis.tangent * local.x + basis.bitangent * local.y + normal * local.z;
}

}  // namespace clamor
