// thin_material.h: tells doors, windows and thin walls from massive ones.
#pragma once

#include <algorithm>

#include "common/material.h"

namespace clamor {

// Least transmission of a thin material in the band where it transmits most: a sound reduction
// index of 20 dB. Massive walls, of 22 dB and more, transmit too, but so little that reflections
// behind them and the shares of re-weighed photons leave it out.
inline constexpr float kThinTransmission = 0.01f;

inline bool is_thin(const Material& material) {
  return std::ranges::max(material.transmission) >= kThinTransmission;
}

}  // namespace clamor
