// page_layout.h: constants and formulas shared by page encoder, decoder and checks.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "formats/bake_file/source_octree.h"
#include "formats/bake_file/source_quantization.h"

namespace clamor::page_layout {

inline constexpr int kCountBits = 10;  // 0 to 1000 sources
inline constexpr int kPowerBits = 10;  // 0 to 961 half decibels
inline constexpr int kWeightBits = 7;  // 16ths, -4 to 4
inline constexpr int kWeightOne = 16;
inline constexpr int kFlagBits = 3;
inline constexpr std::uint32_t kStoresNumbers = 1, kStoresPolarity = 2, kStoresOrder = 4;

// Predicts band b from the bands b - 1 and b - 2, in half decibels below the loudest of the page.
CLAMOR_INLINE std::int32_t predicted(std::int32_t one_below, std::int32_t two_below,
                                     std::int32_t weight_one, std::int32_t weight_two) {
  const auto product = [](std::int32_t a, std::int32_t b) {
    return static_cast<std::uint32_t>(a) * static_cast<std::uint32_t>(b);
  };
  return static_cast<std::int32_t>(product(one_below, weight_one) + product(two_below, weight_two) +
                                   kWeightOne / 2) >>
         4;
}

// Axis of the largest component of a normal, the first of equals.
CLAMOR_INLINE std::int32_t dominant_axis(float x, float y, float z) {
  const float wide_x = x < 0 ? -x : x, wide_y = y < 0 ? -y : y, wide_z = z < 0 ? -z : z;
  const std::int32_t of_two = wide_y > wide_x ? 1 : 0;
  return wide_z > (wide_y > wide_x ? wide_y : wide_x) ? 2 : of_two;
}

// Slope of a plane in 1/65536: steps along the dominant axis of its normal per step along another.
CLAMOR_INLINE std::int32_t slope_of(float normal_along, float normal_longest) {
  const double ratio =
      -65536.0 * static_cast<double>(normal_along) / static_cast<double>(normal_longest);
  return static_cast<std::int32_t>(ratio + (ratio < 0 ? -0.5 : 0.5));
}

// A plane on the position grid, as the height along its dominant axis over the other two
// coordinates.
struct Plane {
  std::size_t w = 0, u = 1, v = 2;        // axes; w is the dominant axis of the normal
  std::int32_t slope_u = 0, slope_v = 0;  // 1/65536

  // Height along w relative to u = v = 0.
  CLAMOR_INLINE std::int32_t rise(std::int64_t u_steps, std::int64_t v_steps) const {
    return static_cast<std::int32_t>((slope_u * u_steps + slope_v * v_steps + 32768) >> 16);
  }
};

CLAMOR_INLINE Plane plane_of(const std::array<float, 3>& normal) {
  Plane plane;
  plane.w = static_cast<std::size_t>(dominant_axis(normal[0], normal[1], normal[2]));
  plane.u = (plane.w + 1) % 3;
  plane.v = (plane.w + 2) % 3;
  plane.slope_u = slope_of(normal[plane.u], normal[plane.w]);
  plane.slope_v = slope_of(normal[plane.v], normal[plane.w]);
  return plane;
}

// Bounds of a node, rounded outwards to the position grid.
struct GridBox {
  std::array<std::int32_t, 3> low{}, high{};

  bool holds(const std::array<std::int32_t, 3>& position) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (position[axis] < low[axis] || position[axis] > high[axis]) return false;
    return true;
  }
};
CLAMOR_INLINE GridBox grid_box_of(const NodeSummary& node) {
  GridBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis);
    box.low[axis] = static_cast<std::int32_t>(
        std::floor(static_cast<double>(node.low_m[i]) * kPositionSteps_per_m));
    box.high[axis] = static_cast<std::int32_t>(
        std::ceil(static_cast<double>(node.high_m[i]) * kPositionSteps_per_m));
  }
  return box;
}

}  // namespace clamor::page_layout
