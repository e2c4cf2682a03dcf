// first_leg.h: how the sound of a probe's secondary source left the probe: a direction and the
// distance to the first surface.
//
// The sources of a probe have no emitter. They store the first leg of their path, in 20 bits. The
// runtime needs it to move the source of the sound away from the probe: the direction weighs the
// directivity, and the first surface tells how much shorter or longer the path becomes. No source
// is on that first surface itself: the runtime traces first reflections.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/maths.h"
#include "common/vec.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/source_quantization.h"

namespace clamor {

inline constexpr int kLegDirectionBits = 6;  // per coordinate, octahedral: 2 degrees of error
inline constexpr std::uint32_t kLegDistances = 256;  // codes; a step is 5.9 %, from 5 cm on
inline constexpr std::uint32_t kFirstLegCodes = kLegDistances << (2 * kLegDirectionBits);

struct FirstLeg {
  Vec3f direction{};  // unit, out of the probe
  float distance_m = 0;
};

// Distance that a code from 1 on stands for.
inline float leg_distance_m(std::uint32_t code) {
  static const auto distances_m = [] {
    std::array<float, kLegDistances> table{};
    for (std::size_t c = 0; c < table.size(); ++c)
      table[c] = static_cast<float>(0.05 * power(10.0, static_cast<double>(c) / 40));
    return table;
  }();
  return distances_m[code % kLegDistances];
}

inline std::uint32_t first_leg_code(const FirstLeg& leg) {
  const double steps = 40 * log2_of(std::max(static_cast<double>(leg.distance_m), 1e-6) / 0.05) *
                       0.30102999566398120;
  const auto distance = static_cast<std::uint32_t>(
      std::clamp(std::floor(steps + 0.5), 1.0, static_cast<double>(kLegDistances - 1)));
  const auto [a, b] = octahedral_code(leg.direction, kLegDirectionBits);
  return distance << (2 * kLegDirectionBits) | std::uint32_t{a} << kLegDirectionBits | b;
}

inline FirstLeg first_leg_of(std::uint32_t code) {
  constexpr std::uint32_t kMask = (1u << kLegDirectionBits) - 1;
  FirstLeg leg;
  direction_of(static_cast<int>(code >> kLegDirectionBits & kMask), static_cast<int>(code & kMask),
               direction_scale(kLegDirectionBits), leg.direction.x, leg.direction.y,
               leg.direction.z);
  leg.distance_m = leg_distance_m(code >> (2 * kLegDirectionBits));
  return leg;
}

// The number of values that a ProbePath can have in a bake.
inline std::uint32_t stored_first_legs(const BakedPortals& portals) {
  const auto sets = static_cast<std::uint32_t>(portals.sets.size());
  return (sets > 0 ? sets : 1) * kFirstLegCodes;
}

}  // namespace clamor
