// energies.h: energy that a bake leaves on a room's surfaces, for tests that compare bakes.
#pragma once

#include <array>
#include <cstddef>

#include "common/bands.h"

namespace clamor::testing {

// Energy that leaves the room's surfaces per band, in three spans of time.
using Energies = std::array<std::array<double, kBandCount>, 3>;
inline void add(Energies& energies, float delay_s, const Bands& power, double share) {
  const std::size_t span = delay_s < 0.02f ? 0 : delay_s < 0.06f ? 1 : 2;
  for (std::size_t b = 0; b < kBandCount; ++b)
    energies[span][b] += share * static_cast<double>(power[b]);
}

}  // namespace clamor::testing
