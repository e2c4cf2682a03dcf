// diffuse_directions.h: sample directions for random walks with diffuse reflections.
//
// The level report uses them before the bake. Both functions map numbers in [0, 1) to directions
// and give the same bits on every CPU.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/maths.h"
#include "common/random.h"
#include "common/vec.h"

namespace clamor {

// The unit vector of height z, rotated around the z axis by `turn` revolutions.
inline Vec3 on_sphere(double z, double turn) {
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * cos_of(2 * std::numbers::pi * turn), r * sin_of(2 * std::numbers::pi * turn), z};
}

// A direction sampled from Lambert's cosine law around `normal`.
inline Vec3 diffuse_direction(const Vec3& normal, const RandomBits& bits) {
  const Vec3 local = on_sphere(std::sqrt(unit_above_zero(bits[0])), unit(bits[1]));
  const Basis basis = basis_around(normal);
  return basis.tangent * local.x + basis.bitangent * local.y + normal * local.z;
}

}  // namespace clamor
