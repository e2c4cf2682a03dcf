// place_order.h: an order of places, by x, then y, then z.
//
// Which end of a line comes first decides from where it is asked, so that its answer is the same
// there and back.
#pragma once

#include "common/vec.h"

namespace clamor {

template <class Real>
bool comes_before(const glm::vec<3, Real>& a, const glm::vec<3, Real>& b) {
  if (a.x != b.x) return a.x < b.x;
  return a.y != b.y ? a.y < b.y : a.z < b.z;
}

}  // namespace clamor
