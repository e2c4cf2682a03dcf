// syllables.h: signals that alternate between loud and silent, with bands that vary independently.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "common/random.h"
#include "runtime/propagation/signal_weights.h"

namespace clamor::testing {

// A loop of two seconds: silence, then random levels over 40 dB that change every 60 ms, separately
// for low and high bands. The maximum of all bands is in the middle.
inline TimedEnvelope syllables(std::uint32_t seed) {
  constexpr std::size_t kMoments = 100;
  std::vector<std::uint8_t> steps(kBandCount * kMoments);
  for (std::size_t m = 0; m < kMoments; ++m) {
    const RandomBits bits = philox(seed, {static_cast<std::uint32_t>(m / 3), 0, 0, 0});
    for (std::size_t b = 0; b < kBandCount; ++b)
      steps[b * kMoments + m] =
          static_cast<std::uint8_t>(m < 20 ? 0 : 170 + 80 * unit(bits[b < kBandCount / 2 ? 0 : 1]));
  }
  for (std::size_t b = 0; b < kBandCount; ++b) steps[b * kMoments + 50] = 255;
  return {*SignalEnvelope::from_steps(same_in_all_bands(1), std::move(steps)),
          kMoments * kMomentFrames, true};
}

}  // namespace clamor::testing
