// band_mix.h: how what a source counts for divides among the bands, and how loud a signal is in
// each: together a far lower bound than that by the loudest band alone.
//
// A ceiling C (radiation_model.h) holds for the loudest that each band of a signal ever is. Let no
// band's part of it exceed f_b C, and band b now be s_b of its loudest: then what is heard now is
// at most
//
//   C sum_b f_b s_b  <=  C max_b s_b.
//
// Of words, drums and strings the right side is 5 dB above what is heard on average, since their
// bands come and go and most sources have two or three of them (10^7 of Sponza, six sounds: 6200
// sources reach the threshold by the right side, 2700 by the left, 2500 do). The former are
// stored in half bytes and the latter in bytes, rounded up, which makes 3000 of the 2700.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/bands.h"

namespace clamor {

// The f_b, each in four bits: (step / 15)^2, so that small parts have small steps.
class BandMix {
 public:
  static constexpr std::uint32_t kBits = 4, kMost = (1u << kBits) - 1;

  BandMix() = default;  // nothing in any band
  static BandMix from_packed(std::uint32_t packed) { return BandMix(packed); }
  // No less than these, which are 0 to 1; what is no number counts as 1.
  static BandMix at_least(const Bands& parts) {
    std::array<std::int32_t, kBandCount> steps;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float root = std::sqrt(parts[b]) * (kMost * kRoundedUp);
      const float step = root < kMost ? root : kMost;
      steps[b] = static_cast<std::int32_t>(step);
      steps[b] += static_cast<float>(steps[b]) < step;
    }
    std::uint32_t packed = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      packed |= static_cast<std::uint32_t>(steps[b]) << (kBits * b);
    return BandMix(packed);
  }

  float part(std::size_t band) const {
    const auto step = static_cast<float>((packed_ >> (kBits * band)) & kMost);
    return step * step * (1.0f / (kMost * kMost));
  }
  // The most of a whole, of whose bands no more than these are heard.
  float of(const Bands& shares) const {
    float most = 0, sum = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      sum += part(b) * shares[b];
      most = std::max(most, shares[b]);
    }
    return std::min(sum, most);
  }
  std::uint32_t packed() const { return packed_; }

 private:
  static constexpr float kRoundedUp = 1.00001f;
  explicit BandMix(std::uint32_t packed) : packed_(packed) {}

  std::uint32_t packed_ = 0;
};

// The s_b: that of the loudest, and the others as parts of it.
struct BandShares {
  static constexpr float kWhole = 255;

  float share = 0;
  std::array<std::uint8_t, kBandCount> parts{};

  // No less than these.
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
