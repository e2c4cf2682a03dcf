#include "runtime/hrtf/diffuse_hrtf_eq.h"

#include <algorithm>
#include <cmath>

namespace clamor {

DiffuseHrtfEq::DiffuseHrtfEq(const Hrtf& head) : head_(head), power_(head.directions()) {
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    const double octave =
        std::clamp(std::log2(erb_band_centre_hz(b) / kBandCentres_hz[0]), 0.0, kBandCount - 1.0);
    for (std::size_t c = 0; c < kBandCount; ++c)
      hat_[c][b] = static_cast<float>(std::max(0.0, 1 - std::abs(octave - static_cast<double>(c))));
  }
}

void DiffuseHrtfEq::begin() noexcept REALTIME { std::ranges::fill(power_, Power{}); }

void DiffuseHrtfEq::add(std::span<const Power> powers) noexcept REALTIME {
  for (std::size_t d = 0; d < powers.size(); ++d)
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t b = 0; b < kBandCount; ++b) power_[d].at[e][b] += powers[d].at[e][b];
}

std::array<HrtfGains, kEars> DiffuseHrtfEq::levels() const noexcept REALTIME {
  using Sums = std::array<std::array<float, kErbBandCount>, kEars>;
  Sums wanted{}, given{};
  for (std::size_t d = 0; d < power_.size(); ++d)
    for (std::size_t e = 0; e < kEars; ++e) {
      const Bands& power = power_[d].at[e];
      if (!(*std::ranges::max_element(power) > 0)) continue;
      const Hrtf::Energies& energies = head_.energies(d);
      std::array<float, kErbBandCount> here{};
      for (std::size_t c = 0; c < kBandCount; ++c)
        for (std::size_t b = 0; b < kErbBandCount; ++b) here[b] += power[c] * hat_[c][b];
      for (std::size_t b = 0; b < kErbBandCount; ++b) {
        wanted[e][b] += here[b] * energies.measured[e][b];
        given[e][b] += here[b] * energies.octaves[e][b];
      }
    }
  std::array<HrtfGains, kEars> levels;
  for (std::size_t e = 0; e < kEars; ++e) {
    ErbBands change;
    for (std::size_t b = 0; b < kErbBandCount; ++b)
      change[b] = given[e][b] > 0 ? std::clamp(std::sqrt(static_cast<double>(wanted[e][b]) /
                                                         static_cast<double>(given[e][b])),
                                               1 / kMaxChange, kMaxChange)
                                  : 1;
    levels[e] = head_.changed_by(change);
  }
  return levels;
}

}  // namespace clamor
