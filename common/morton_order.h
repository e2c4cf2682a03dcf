// morton_order.h: places in an order in which neighbours follow each other.
//
// G. M. Morton. A computer oriented geodetic data base and a new technique in file sequencing. IBM,
// 1966: the bits of the coordinates take turns.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/vec.h"

namespace clamor {

// Indices of the places along the curve, in 2^21 steps of their longest extent; of equals the lower
// index first.
std::vector<std::size_t> morton_order(std::span<const Vec3> places);

}  // namespace clamor
