#include "runtime/propagation/late_boost.h"

#include <cmath>

#include "formats/bake_file/bake_metadata.h"

namespace clamor {

namespace {

constexpr double kMixture = 0.5;           // c
constexpr double kRatePerDecayRate = 1.1;  // r
constexpr double kFullSources = 250'000;   // c falls beyond

// Mean T30 of 2 to 8 kHz; 0 if unknown.
double t60_of(const DecaySummary& decay) {
  constexpr std::size_t k2000Hz = 5;
  static_assert(kBandCentres_hz[k2000Hz] == 2000);
  double sum = 0;
  int bands = 0;
  for (std::size_t b = k2000Hz; b < kBandCount; ++b) {
    sum += static_cast<double>(decay.t30_s[b]);
    bands += decay.t30_s[b] > 0;
  }
  return bands > 0 ? sum / bands : 0;
}

// Factor of c for so many sources.
double share_for(std::uint64_t sources) {
  const double part = kFullSources / std::max(static_cast<double>(sources), kFullSources);
  return part * part;
}

}  // namespace

LateBoost::LateBoost(double t60_s, double share) {
  if (!(t60_s > 0)) return;
  const double per_s = kRatePerDecayRate * std::log(1e6) / t60_s;
  for (std::size_t i = 0; i < boost_.size(); ++i) {
    const double t = std::min(static_cast<double>(i) / static_cast<double>(kStepsPerS), kUntil_s);
    // The limit keeps a dry room's value within a float.
    const double grown = (std::exp(std::min(per_s * t, 50.0)) - 1) / (per_s * kUntil_s);
    boost_[i] = static_cast<float>(std::min(share * kMixture * grown, kMaxBoost - 1));
  }
}

LateBoost::LateBoost(const DecaySummary& decay, std::uint64_t sources)
    : LateBoost(t60_of(decay), share_for(sources)) {}

}  // namespace clamor
