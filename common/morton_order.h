// morton_order.h: sorts positions along a Morton curve.
//
// G. M. Morton. A computer oriented geodetic data base and a new technique in file sequencing. IBM,
// 1966: the bits of the coordinates take turns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/vec.h"

namespace clamor {

// Morton code of a position given in steps, which are not negative and below 2^21.
std::uint64_t morton_code(const Vec3& steps);

// Indices of the positions in Morton order, quantised to 2^21 steps of their longest extent. Ties
// are broken by the lower index.
std::vector<std::size_t> morton_order(std::span<const Vec3> places);

}  // namespace clamor
