#include "formats/level/portal.h"

#include <cmath>

namespace clamor {

namespace {

constexpr double kMinHalf_m = 0.005, kMaxHalf_m = 1e6;
constexpr double kMaxSkew = 0.5;  // cosine of the angle between the sides

}  // namespace

bool is_rectangle(const Portal& portal) {
  for (const Vec3* half_m : {&portal.half_u_m, &portal.half_v_m})
    if (!is_finite(*half_m) || !(length(*half_m) >= kMinHalf_m && length(*half_m) <= kMaxHalf_m))
      return false;
  const double cosine =
      dot(portal.half_u_m, portal.half_v_m) / (length(portal.half_u_m) * length(portal.half_v_m));
  return is_finite(portal.centre_m) && std::abs(cosine) <= kMaxSkew;
}

}  // namespace clamor
