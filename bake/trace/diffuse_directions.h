// diffuse_directions.h: directions for walks that leave surfaces by Lambert's law, for looking
// round a level before it is baked.
//
// Both are functions of numbers from [0, 1) alone, computed the same way on every CPU.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/maths.h"
#include "common/random.h"
#include "common/vec.h"

namespace clamor {

// The unit vector of height z at `turn` turns round the z axis.
inline Vec3 on_sphere(double z, double turn) {
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * cos_of(2 * std::numbers::pi * turn), r * sin_of(2 * std::numbers::pi * turn), z};
}

// A direction that leaves a surface with this normal, cosine-distributed.
inline Vec3 diffuse_direction(const Vec3& normal, const RandomBits& bits) {
  const Vec3 local = on_sphere(std::sqrt(unit_above_zero(bits[0])), unit(bits[1]));
  const Basis basis = basis_around(normal);
  return basis.tangent * local.x + basis.bitangent * local.y + normal * local.z;
}

}  // namespace clamor
