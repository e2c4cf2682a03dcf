// validity_region.h: where, until when and above which threshold a cached result holds.
#pragma once

#include <limits>

#include "common/vec.h"

namespace clamor {

// A ball, in the space of the tree that the result is of. A query is the region with a radius of 0
// that lasts until now.
struct ValidityRegion {
  Vec3 centre{};
  double radius_m = -1;  // negative: nowhere
  double threshold = 0;  // linear priority
  double until_s = std::numeric_limits<double>::infinity();

  bool contains(const ValidityRegion& other) const {
    const Vec3 offset_m = other.centre - centre;
    const double left_m = radius_m - other.radius_m;
    return left_m >= 0 && dot(offset_m, offset_m) <= left_m * left_m &&
           other.threshold >= threshold && other.until_s <= until_s;
  }
};

}  // namespace clamor
