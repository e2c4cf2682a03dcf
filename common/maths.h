// maths.h: elementary functions with the same bits on every CPU.
//
// The C library selects its exp, log, pow, sin and cos by CPU features, and they round differently
// with and without fused multiply-add. Where a result reaches the bake file or decides a photon's
// path, these functions are used instead. They consist of additions, multiplications, divisions and
// square roots, which IEEE 754 rounds in only one way. (The project is compiled without contraction
// and never with -ffast-math.)
//
// The float functions have no branches, so that loops over arrays are vectorised; the double ones
// are for tables. The stated errors are the maxima found by tests/common/maths_test.cpp.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <type_traits>

namespace clamor {

#define CLAMOR_INLINE [[gnu::always_inline]] inline

#include "common/maths_series-inl.h"

// sin and cos of 2 pi u for u in [0, 1]. Absolute error below 1.5e-7.
struct SinCos {
  float sin, cos;
};
CLAMOR_INLINE SinCos sin_cos_of_turn(float u) {
  const float quarters = u * 4;
  const float k = (quarters + 12582912.0f) - 12582912.0f;
  const float r = quarters - k;  // in quarter turns, |r| <= 1/2
  const float r2 = r * r;
  const float s =
      r *
      (1.57079633f +
       r2 * (-0.645964098f + r2 * (7.96926263e-2f + r2 * (-4.68175414e-3f + r2 * 1.60441185e-4f))));
  const float c =
      1.0f + r2 * (-1.23370055f +
                   r2 * (0.253669508f +
                         r2 * (-2.08634807e-2f + r2 * (9.19260275e-4f + r2 * -2.52020424e-5f))));
  const auto quadrant = static_cast<std::int32_t>(k);
  const bool swapped = (quadrant & 1) != 0;
  const float sine = swapped ? c : s, cosine = swapped ? s : c;
  return {(quadrant & 2) != 0 ? -sine : sine, ((quadrant + 1) & 2) != 0 ? -cosine : cosine};
}

// Double precision, relative error below 1e-15 (for power: 1e-14 times max(1, |exponent log2(base)|
// / 10)). For tables, not for inner loops.
double log2_of(double x);  // x > 0
double exp2_of(double x);  // 0 below -1022
double exp_of(double x);
double power(double base, double exponent);  // base >= 0; 0 to a positive power is 0
double sin_of(double radians);               // |radians| below 1e5
double cos_of(double radians);
double acos_of(double x);  // -1 to 1

// The C libraries of Linux and Windows round exp, log, sin and cos alike but for one result in a
// thousand, and hypot, acosh and asinh differently in every third to eighth. These are fast, and
// meant for lengths in metres: squares do not overflow, and errors are below 1e-15 times
// max(1, result).
inline double hypotenuse(double x, double y) { return std::sqrt(x * x + y * y); }
inline double arcosh(double x) {
  return std::numbers::ln2 * log2_of(x + std::sqrt((x - 1) * (x + 1)));
}
inline double arsinh(double x) {
  return std::copysign(std::numbers::ln2 * log2_of(std::abs(x) + std::sqrt(x * x + 1)), x);
}

}  // namespace clamor
