#include "tools/analysis/binaural_cues.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "runtime/response/octave_filter.h"

namespace clamor {

namespace {

constexpr double kMaxLag_s = 1e-3, kFloor = 1e-6;
constexpr int kLags = 200;  // to either side: 5 us apart, a 17th of the period of 11.3 kHz

struct Peak {
  double lag_s, correlation, magnitude;
};

// The maximum of the cross-correlation, on a parabola through it and its neighbours.
Peak peak_of(const std::vector<std::complex<double>>& cross, double energy) {
  std::array<double, 2 * kLags + 1> correlation{};
  for (std::size_t k = 0; k < cross.size(); ++k) {
    if (cross[k] == std::complex<double>(0)) continue;
    const double radians_per_lag =
        2 * std::numbers::pi * spectrum_bin_hz(static_cast<double>(k)) * kMaxLag_s / kLags;
    const std::complex<double> step = std::polar(1.0, radians_per_lag);
    std::complex<double> value = cross[k] * std::polar(1.0, -kLags * radians_per_lag);
    for (double& at_lag : correlation) {
      at_lag += value.real();
      value = {value.real() * step.real() - value.imag() * step.imag(),
               value.real() * step.imag() + value.imag() * step.real()};
    }
  }
  const auto best = std::max_element(correlation.begin(), correlation.end());
  double magnitude = 0;
  for (const double c : correlation) magnitude = std::max(magnitude, std::abs(c));
  double lag = static_cast<double>(best - correlation.begin()) - kLags, top = *best;
  if (best != correlation.begin() && best != correlation.end() - 1) {
    const double before = best[-1], after = best[1], bend = 2 * *best - before - after;
    if (bend > 0) {
      lag += (after - before) / (2 * bend);
      top += (after - before) * (after - before) / (8 * bend);
    }
  }
  magnitude = std::max(magnitude, top);
  return {lag * kMaxLag_s / kLags, top / energy, magnitude / energy};
}

}  // namespace

BinauralCues binaural_cues(const SoundSpectrum& spectrum) {
  BinauralCues cues;
  if (spectrum.cross.empty()) return cues;
  std::array<std::array<double, 2>, kBandCount> energy{};
  std::vector<std::vector<double>> gain(kBandCount, std::vector<double>(kSpectrumBins));
  double loudest = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    for (std::size_t k = 0; k < kSpectrumBins; ++k) {
      gain[b][k] = std::pow(octave_gain(b, spectrum_bin_hz(static_cast<double>(k))), 2);
      for (std::size_t ear = 0; ear < 2; ++ear)
        energy[b][ear] += gain[b][k] * spectrum.energy[ear][k];
    }
    loudest = std::max({loudest, energy[b][0], energy[b][1]});
  }
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const auto [left, right] = energy[b];
    const double louder = std::max(left, right);
    if (!(louder > kFloor * loudest)) continue;
    cues.ild_db[b] =
        10 * std::log10(std::max(right, kFloor * louder) / std::max(left, kFloor * louder));
    if (std::min(left, right) <= kFloor * loudest) continue;
    std::vector<std::complex<double>> cross(kSpectrumBins);
    for (std::size_t k = 0; k < kSpectrumBins; ++k)
      if (gain[b][k] > 1e-9) cross[k] = gain[b][k] * spectrum.cross[k];
    const Peak peak = peak_of(cross, std::sqrt(left * right));
    cues.iacc[b] = std::min(1.0, peak.magnitude);
    if (peak.correlation >= kMinIaccForItd) cues.itd_s[b] = peak.lag_s;
  }
  return cues;
}

}  // namespace clamor
