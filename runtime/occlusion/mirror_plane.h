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
  Vec3 mirrored(const Vec3& direction) const {
    return direction - 2 * dot(normal, direction) * normal;
  }
  void turn_round() {
    normal = -normal;
    offset_m = -offset_m;
  }
};

}  // namespace clamor
