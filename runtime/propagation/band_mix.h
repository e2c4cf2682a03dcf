// band_mix.h: how a source's weight divides among the bands, and the current level of a signal in
// each band: together a tighter upper bound of the weight than the loudest band alone.
//
// An upper bound C of a source's weight (radiation_model.h) assumes that each band of its signal is
// at its maximum. If band b contributes at most f_b C, and its level is now s_b of its maximum,
// then the weight is now at most
//
//   C sum_b f_b s_b  <=  C max_b s_b.
//
// For speech, drums and strings the right-hand bound is 5 dB above the weight on average, because
// most sources have energy in two or three bands, and these come and go (10^7 sources in Sponza,
// six signals: 6200 reach the threshold by the right-hand bound, 2700 by the left-hand one, 2500
// in fact). The f_b are stored in four bits and the s_b in eight, rounded up; 3000 sources reach
// the threshold then.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/bands.h"

namespace clamor {

// The f_b, each in four bits as (step / 15)^2, which resolves small values finely.
class BandMix {
 public:
  static constexpr std::uint32_t kBits = 4, kMax = (1u << kBits) - 1;

  BandMix() = default;  // zero in all bands
  static BandMix from_packed(std::uint32_t packed) { return BandMix(packed); }
  // Rounds up values from 0 to 1; NaN becomes 1.
  static BandMix at_least(const Bands& parts) {
    std::array<std::int32_t, kBandCount> steps;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float root = std::sqrt(parts[b]) * (kMax * kRoundUp);
      const float step = root < kMax ? root : kMax;
      steps[b] = static_cast<std::int32_t>(step);
      steps[b] += static_cast<float>(steps[b]) < step;
    }
    std::uint32_t packed = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      packed |= static_cast<std::uint32_t>(steps[b]) << (kBits * b);
    return BandMix(packed);
  }

  float part(std::size_t band) const {
    const auto step = static_cast<float>((packed_ >> (kBits * band)) & kMax);
    return step * step * (1.0f / (kMax * kMax));
  }
  // Upper bound of the weight as a fraction of C, for bands at these levels (the s_b).
  float of(const Bands& shares) const {
    float max = 0, sum = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      sum += part(b) * shares[b];
      max = std::max(max, shares[b]);
    }
    return std::min(sum, max);
  }
  std::uint32_t packed() const { return packed_; }

 private:
  static constexpr float kRoundUp = 1.00001f;  // exceeds the rounding of the square root
  explicit BandMix(std::uint32_t packed) : packed_(packed) {}

  std::uint32_t packed_ = 0;
};

// The s_b: the highest of them, and each as a fraction of it.
struct BandShares {
  static constexpr float kWhole = 255;

  float share = 0;
  std::array<std::uint8_t, kBandCount> parts{};

  // Rounds up.
  static BandShares at_least(const Bands& shares) {
    BandShares all{*std::max_element(shares.begin(), shares.end())};
    if (!(all.share > 0)) return {};
    for (std::size_t b = 0; b < kBandCount; ++b)
      all.parts[b] = static_cast<std::uint8_t>(std::ceil(shares[b] / all.share * kWhole));
    return all;
  }
  static constexpr BandShares whole() {
    BandShares all{1};
    all.parts.fill(static_cast<std::uint8_t>(kWhole));
    return all;
  }
};

}  // namespace clamor
