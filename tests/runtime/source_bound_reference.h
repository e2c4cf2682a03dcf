// source_bound_reference.h: upper bounds of priorities in double precision.
#pragma once

#include <algorithm>
#include <cmath>

#include "runtime/propagation/source_bound.h"

namespace clamor::testing {

// Bounds of vector code are higher by at most this factor and the error of positions.
inline constexpr double kMaxBoundExcess = 1.003;

inline double priority_upper_bound(const SourceBound& s, const Vec3& place) {
  const Vec3 to_listener = place - Vec3(s.position_m), normal(s.normal), mirror(s.mirror);
  const double r_m = length(to_listener);
  const double spread = 1 / std::max<double>(r_m * r_m, s.radius2_m2);
  const auto bounce_up_to = [&](double cos_o) {
    const double x = s.slope * cos_o > 1 ? 1 / static_cast<double>(s.slope) : cos_o;
    return s.compensation * x * std::exp(-s.slope * x);
  };
  if (r_m == 0) return (s.diffuse + bounce_up_to(1) + static_cast<double>(s.lobe)) * spread;
  const double cos_a = std::min(dot(to_listener, mirror) / r_m, 1.0),
               cos_o = dot(to_listener, normal) / r_m;
  const double lobe = s.lobe * std::exp(-s.fall * (1 - cos_a));
  if (s.slope < 0) return lobe * spread;  // an emitter
  if (cos_o <= 0) return 0;
  const double cos_i = std::max(dot(mirror, normal), 1e-9);
  return (s.diffuse * cos_o + bounce_up_to(cos_o) + lobe * std::min(1.0, cos_o / cos_i)) * spread;
}

}  // namespace clamor::testing
