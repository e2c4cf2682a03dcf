// sphere.h: directions, with the same bits on every CPU.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "common/maths.h"
#include "common/vec.h"

namespace clamor {

// The unit vector of height z, rotated around the z axis by `turn` revolutions.
inline Vec3 on_sphere(double z, double turn) {
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * cos_of(2 * std::numbers::pi * turn), r * sin_of(2 * std::numbers::pi * turn), z};
}

// Fibonacci sphere: `count` evenly distributed directions.
inline Vec3 spread_direction(std::uint32_t index, std::uint32_t count) {
  constexpr double kGolden = 0.6180339887498949;
  const double turn = index * kGolden;
  return on_sphere(1 - (2 * index + 1.0) / count, turn - std::floor(turn));
}

}  // namespace clamor
