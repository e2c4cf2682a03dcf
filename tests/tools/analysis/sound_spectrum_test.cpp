#include "tools/analysis/sound_spectrum.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/hrtf/erb_bands.h"
#include "tests/tools/analysis/test_sounds.h"
#include "tools/analysis/erb_spectrum.h"

namespace clamor {
namespace {

using testing::mono;
using testing::noise;
using testing::sine;
using testing::stereo;
using testing::swelling;

double total(const std::vector<double>& energy) {
  return std::accumulate(energy.begin(), energy.end(), 0.0);
}

TEST(SoundSpectrum, HasTheEnergyOfASoundAtAnyTime) {
  for (const std::size_t at : {0u, 1u, 2047u, 2048u, 5000u, 9999u}) {
    std::vector<float> click(10000);
    click[at] = 0.5f;
    const SoundSpectrum spectrum = sound_spectrum(mono(click));
    EXPECT_NEAR(total(spectrum.energy[0]), 0.25, 1e-12) << at;
    // White spectrum: all bins but the ends are equal.
    EXPECT_NEAR(spectrum.energy[0][1], 0.25 / 4096, 1e-12);
    EXPECT_NEAR(spectrum.energy[0][4000], 0.25 / 4096, 1e-12);
  }
  const auto left = noise(1, 0.1, 0.7), right = noise(2, 0.2, 0.7);
  const SoundSpectrum spectrum = sound_spectrum(stereo(left, right));
  for (const int ear : {0, 1}) {
    double energy = 0;
    for (const float x : ear == 0 ? left : right) energy += static_cast<double>(x) * x;
    EXPECT_NEAR(total(spectrum.energy[ear]), energy, 1e-9 * energy);
  }
}

TEST(SoundSpectrum, HasTheCoherenceOfTheEarsAndTheDelayOfTheRightOne) {
  const auto left = noise(3, 0.1, 1);
  const SoundSpectrum same = sound_spectrum(stereo(left, left));
  const SoundSpectrum shifted = sound_spectrum(stereo(left, testing::later(left, 4)));
  for (const std::size_t k : {10u, 100u, 1000u, 4000u}) {
    EXPECT_NEAR(std::abs(same.cross[k] - same.energy[0][k]), 0, 1e-12);
    const double radians = std::arg(shifted.cross[k]) + 2 * std::numbers::pi * 4 * k / 8192.0;
    EXPECT_NEAR(std::remainder(radians, 2 * std::numbers::pi), 0, 0.02) << k;
  }
}

TEST(ErbSpectrum, OfAClickGrowsWithTheWidthOfTheBands) {
  std::vector<float> click(20000);
  click[9000] = 1;
  const ErbBands bands = erb_spectrum(sound_spectrum(mono(click)).energy[0]);
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    const double low_hz = erb_frequency_hz(static_cast<double>(b) + 1);
    const double high_hz = erb_frequency_hz(static_cast<double>(b) + 2);
    EXPECT_NEAR(bands[b], (high_hz - low_hz) / 24000, 1e-9) << b;
  }
}

TEST(ErbSpectrum, OfASineLiesInItsBand) {
  for (const std::size_t b : {5u, 15u, 30u}) {
    const ErbBands bands =
        erb_spectrum(sound_spectrum(mono(swelling(sine(erb_band_centre_hz(b), 0.5, 2)))).energy[0]);
    const double energy = 96000 * 0.125 * 3 / 8;
    EXPECT_NEAR(bands[b] / energy, 1, 1e-4) << b;
  }
}

}  // namespace
}  // namespace clamor
