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

Portal facing_portal(const Vec3& centre_m, const Vec3& facing, double width_m, double height_m) {
  Portal portal;
  const Vec3 normal = normalize(facing), across = cross(Vec3(0, 1, 0), normal);
  const Vec3 u =
      length(across) > 1e-3 ? normalize(across) : normalize(Vec3(1, 0, 0) - normal * normal.x);
  portal.centre_m = centre_m;
  portal.half_u_m = u * (width_m / 2);
  portal.half_v_m = cross(normal, u) * (height_m / 2);
  return portal;
}

Vec3 normal_of(const Portal& portal) { return normalize(cross(portal.half_u_m, portal.half_v_m)); }

bool passes(const Portal& portal, const Vec3& from_m, const Vec3& to_m) {
  const Vec3 normal = cross(portal.half_u_m, portal.half_v_m);
  const double from = dot(from_m - portal.centre_m, normal);
  const double to = dot(to_m - portal.centre_m, normal);
  if ((from < 0) == (to < 0)) return false;
  const Vec3 at_m = from_m + from / (from - to) * (to_m - from_m) - portal.centre_m;
  // The coordinates of the point in the plane, a and b, by Cramer's rule.
  const double area2 = dot(normal, normal);
  const double a = dot(cross(at_m, portal.half_v_m), normal) / area2;
  const double b = dot(cross(portal.half_u_m, at_m), normal) / area2;
  return std::abs(a) <= 1 && std::abs(b) <= 1;
}

}  // namespace clamor
