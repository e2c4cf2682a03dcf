#include "tools/analysis/binaural_cues.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/tools/analysis/test_sounds.h"

namespace clamor {
namespace {

using testing::later;
using testing::mono;
using testing::noise;
using testing::plus;
using testing::stereo;
using testing::times;

BinauralCues cues_of(const std::vector<float>& left, const std::vector<float>& right) {
  return binaural_cues(sound_spectrum(stereo(left, right)));
}

TEST(BinauralCues, FindTheDelayBetweenTheEarsInEveryOctave) {
  const auto sound = noise(1, 0.1, 4);
  for (const std::size_t frames : {0u, 1u, 7u, 31u}) {
    const BinauralCues right_late = cues_of(sound, later(sound, frames));
    const BinauralCues left_late = cues_of(later(sound, frames), sound);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      // The tolerance is a hundredth of a sample, or a tenth at 63 Hz, where the correlation is
      // nearly flat.
      EXPECT_NEAR(*right_late.itd_s[b], static_cast<double>(frames) / kSampleRate_hz,
                  b == 0 ? 4e-6 : 1e-6)
          << frames << " frames, " << kBandCentres_hz[b] << " Hz";
      EXPECT_NEAR(*left_late.itd_s[b], -static_cast<double>(frames) / kSampleRate_hz,
                  b == 0 ? 4e-6 : 1e-6);
      EXPECT_NEAR(*right_late.iacc[b], 1, 2e-3);
      EXPECT_NEAR(*right_late.ild_db[b], 0, 0.01);
    }
  }
}

TEST(BinauralCues, FindAFractionalDelay) {
  // The mean of two neighbouring samples has a delay of half a sample and linear phase.
  const auto sound = noise(2, 0.1, 4);
  const auto right = plus(times(later(sound, 5), 0.5), times(later(sound, 6), 0.5));
  const BinauralCues cues = cues_of(sound, right);
  for (std::size_t b = 1; b < kBandCount; ++b)
    EXPECT_NEAR(*cues.itd_s[b], 5.5 / kSampleRate_hz, 1e-6) << kBandCentres_hz[b];
}

TEST(BinauralCues, FindTheGainBetweenTheEarsButNotPolarity) {
  const auto sound = noise(3, 0.1, 2);
  for (const double gain : {0.1, 0.5, -1.0, 2.0}) {
    const BinauralCues cues = cues_of(sound, times(sound, gain));
    for (std::size_t b = 0; b < kBandCount; ++b) {
      EXPECT_NEAR(*cues.ild_db[b], 20 * std::log10(std::abs(gain)), 1e-4);
      EXPECT_NEAR(*cues.iacc[b], 1, 1e-4) << gain;
    }
  }
}

TEST(BinauralCues, FindTheCoherenceOfTheEars) {
  const auto shared = noise(4, 0.1, 20), own = noise(5, 0.1, 20);
  for (const double rho : {0.4, 0.7, 0.9}) {
    const BinauralCues cues =
        cues_of(shared, plus(times(shared, rho), times(own, std::sqrt(1 - rho * rho))));
    // An octave of w Hz has w t independent pairs in t seconds; the tolerance is three standard
    // errors.
    for (std::size_t b = 2; b < kBandCount; ++b)
      EXPECT_NEAR(*cues.iacc[b], rho,
                  3 * (1 - rho * rho) / std::sqrt(kBandCentres_hz[b] * 0.707 * 20) + 2e-3)
          << kBandCentres_hz[b];
  }
}

TEST(BinauralCues, GiveNoDirectionForUncorrelatedSounds) {
  const BinauralCues cues = cues_of(noise(6, 0.1, 10), noise(7, 0.1, 10));
  for (std::size_t b = 2; b < kBandCount; ++b) {
    EXPECT_FALSE(cues.itd_s[b]) << kBandCentres_hz[b];
    EXPECT_LT(*cues.iacc[b], 0.2);
  }
}

TEST(BinauralCues, AreBoundedOrAbsentForASilentEarOrBand) {
  const auto sound = testing::swelling(testing::sine(1000, 0.1, 1));
  const BinauralCues left_only = cues_of(sound, std::vector<float>(sound.size()));
  EXPECT_NEAR(*left_only.ild_db[4], -60, 1e-6);
  EXPECT_FALSE(left_only.itd_s[4] || left_only.iacc[4]);
  EXPECT_FALSE(left_only.ild_db[0]);  // both ears are silent in that band
  const BinauralCues silent = cues_of(std::vector<float>(48000), std::vector<float>(48000));
  const BinauralCues one_ear = binaural_cues(sound_spectrum(mono(sound)));
  for (std::size_t b = 0; b < kBandCount; ++b)
    EXPECT_FALSE(silent.ild_db[b] || silent.iacc[b] || one_ear.ild_db[b] || one_ear.iacc[b]);
}

}  // namespace
}  // namespace clamor
