// directivity.h: how strongly an emitter radiates off its axis.
//
// Intensity at angle a to the axis is ((1 + cos a) / 2)^p of that on the axis: p = 0 radiates
// alike everywhere, 1 is a cardioid in power. On-axis level does not depend on p (a designer's
// gain is an on-axis gain), so the power radiated does. The law is the paper's (section 4, after
// Takala and Hahn 1992), normalised on the axis.
#pragma once

#include <cmath>
#include <numbers>

#include "common/maths.h"

namespace clamor {

// Share of the on-axis intensity at cos a.
inline double emission(double exponent, double cos_a) { return power((1 + cos_a) / 2, exponent); }

// Power radiated per unit of on-axis intensity at 1 m: 4 pi / (p + 1).
inline double emission_power(double exponent) { return 4 * std::numbers::pi / (exponent + 1); }

// cos a drawn with density proportional to emission(exponent, cos a) per steradian, from a
// uniform u in [0, 1). The inverse of the law's distribution function ((1 + cos a) / 2)^(p + 1).
inline double draw_emission_cos(double exponent, double u) {
  return 2 * power(u, 1 / (exponent + 1)) - 1;
}

}  // namespace clamor
