// random_fractions.h: random fractions per band.
#pragma once

#include <cmath>
#include <cstdint>

#include "common/bands.h"
#include "common/random.h"

namespace clamor::testing {

// Values from 0 to 1, most of them small.
inline Bands random_fractions(std::uint32_t seed) {
  Bands parts;
  for (std::uint32_t b = 0; b < kBandCount; ++b) {
    const RandomBits bits = philox(seed, {b, 1, 0, 0});
    parts[b] = bits[0] % 5 == 0 ? 0 : static_cast<float>(std::pow(10, -3 * unit(bits[1])));
  }
  return parts;
}

}  // namespace clamor::testing
