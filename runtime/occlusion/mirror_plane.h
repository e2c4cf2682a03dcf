// mirror_plane.h: a plane in which sources have images.
#pragma once

#include "common/vec.h"

namespace clamor {

// The points p with dot(normal, p) = offset_m.
struct MirrorPlane {
  Vec3 normal{0, 1, 0};  // unit
  double offset_m = 0;

  double height_m(const Vec3& point_m) const { return dot(normal, point_m) - offset_m; }
  Vec3 image_of(const Vec3& point_m) const { return point_m - 2 * height_m(point_m) * normal; }
  // Where the line through two points crosses it; the first point if it does not.
  Vec3 crossing_m(const Vec3& a_m, const Vec3& b_m) const {
    const double a = height_m(a_m), b = height_m(b_m);
    return a == b ? a_m : a_m + a / (a - b) * (b_m - a_m);
  }
  Vec3 mirrored(const Vec3& direction) const {
    return direction - 2 * dot(normal, direction) * normal;
  }
  void turn_round() {
    normal = -normal;
    offset_m = -offset_m;
  }
};

}  // namespace clamor
