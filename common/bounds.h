// bounds.h: the axis-aligned bounding box of points.
#pragma once

#include <functional>
#include <iterator>
#include <limits>
#include <type_traits>

#include "common/vec.h"

namespace clamor {

// Empty, with low_m above high_m, until a point is added.
template <class Vector>
struct BasicBounds {
  using Value = typename Vector::value_type;

  Vector low_m{std::numeric_limits<Value>::max()};
  Vector high_m{std::numeric_limits<Value>::lowest()};

  void add(const Vector& point_m) {
    low_m = glm::min(low_m, point_m);
    high_m = glm::max(high_m, point_m);
  }
  void add(const BasicBounds& other) {
    low_m = glm::min(low_m, other.low_m);
    high_m = glm::max(high_m, other.high_m);
  }
  bool is_empty() const { return low_m.x > high_m.x; }
  bool touches(const BasicBounds& other) const {
    return glm::all(glm::lessThanEqual(low_m, other.high_m)) &&
           glm::all(glm::lessThanEqual(other.low_m, high_m));
  }
  double diagonal_m() const { return length(Vec3(high_m) - Vec3(low_m)); }
  // The squared distance of a point to the box; zero inside.
  double distance2_m2(const Vec3& point_m) const {
    const Vec3 outside_m =
        glm::max(glm::max(Vec3(low_m) - point_m, point_m - Vec3(high_m)), Vec3(0));
    return dot(outside_m, outside_m);
  }
};

using Bounds = BasicBounds<Vec3>;
using Boundsf = BasicBounds<Vec3f>;

// The bounds of the places of `items`; of the items themselves if these are points.
template <class Items, class Place = std::identity>
auto bounds_of(const Items& items, const Place& place = {}) {
  BasicBounds<std::remove_cvref_t<std::invoke_result_t<Place, decltype(*std::begin(items))>>>
      bounds;
  for (const auto& item : items) bounds.add(std::invoke(place, item));
  return bounds;
}

}  // namespace clamor
