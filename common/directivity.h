// directivity.h: radiation pattern of an emitter about its axis.
//
// Intensity at angle a to the axis is ((1 + cos a) / 2)^p of the on-axis intensity: p = 0 is
// omnidirectional, p = 1 a cardioid in power. The on-axis level does not depend on p, because a
// designer's gain is an on-axis gain; the radiated power does. The law is the paper's (section 4,
// after Takala and Hahn 1992), normalised on the axis.
#pragma once

#include <cmath>
#include <numbers>

#include "common/maths.h"

namespace clamor {

// Intensity relative to the axis.
inline double emission(double exponent, double cos_a) { return power((1 + cos_a) / 2, exponent); }

// Radiated power per unit of on-axis intensity at 1 m: 4 pi / (p + 1).
inline double emission_power(double exponent) { return 4 * std::numbers::pi / (exponent + 1); }

// Samples cos a with density proportional to emission(exponent, cos a) per steradian, by inverting
// the distribution function ((1 + cos a) / 2)^(p + 1). `u` is uniform in [0, 1).
inline double draw_emission_cos(double exponent, double u) {
  return 2 * power(u, 1 / (exponent + 1)) - 1;
}

}  // namespace clamor
