#include "tools/analysis/programme_loudness.h"

#include <cmath>

#include <gtest/gtest.h>

#include "runtime/propagation/loudness.h"
#include "tests/tools/analysis/test_sounds.h"

namespace clamor {
namespace {

using testing::mono;
using testing::sine;
using testing::stereo;

double amplitude(double level_db) { return std::pow(10, level_db / 20); }

TEST(ProgrammeLoudness, OfAFullScaleSineInOneEarIsMinus3Lkfs) {
  // BS.1770-4, annex 1: 0 dB FS at 997 Hz in one channel reads -3.01 LKFS.
  EXPECT_NEAR(programme_loudness(mono(sine(997, 1, 5))).integrated_lufs, -3.01, 0.01);
  EXPECT_NEAR(programme_loudness(stereo(sine(997, 1, 5), sine(997, 1, 5))).integrated_lufs, 0,
              0.01);
}

TEST(ProgrammeLoudness, PassesTheFirstCasesOfEbuTech3341) {
  const auto tone = [](double level_db, double seconds) {
    return sine(1000, amplitude(level_db), seconds);
  };
  for (const double level_db : {-23.0, -33.0}) {
    const auto left = tone(level_db, 20);
    const ProgrammeLoudness found = programme_loudness(stereo(left, left));
    EXPECT_NEAR(found.integrated_lufs, level_db, 0.1);
    ASSERT_EQ(found.momentary_lufs.size(), 197u);  // (20 - 0.4) / 0.1 + 1
    for (const double lufs : found.momentary_lufs) EXPECT_NEAR(lufs, level_db, 0.1);
  }
  // Case 3: pauses do not count.
  std::vector<float> programme = tone(-36, 10);
  for (const auto& part : {tone(-23, 60), tone(-36, 10)})
    programme.insert(programme.end(), part.begin(), part.end());
  EXPECT_NEAR(programme_loudness(stereo(programme, programme)).integrated_lufs, -23, 0.1);
}

TEST(ProgrammeLoudness, WeighsFrequenciesLikeTheSampler) {
  const Bands weights = loudness_weights();
  const auto loudness = [](double hz) {
    return programme_loudness(mono(sine(hz, 0.1, 2))).integrated_lufs;
  };
  for (const std::size_t b : {0u, 2u, 6u, 7u})
    EXPECT_NEAR(loudness(kBandCentres_hz[b]) - loudness(1000),
                10 * std::log10(weights[b] / weights[4]), 0.02);
}

TEST(ProgrammeLoudness, OfSilenceOrLessThanAWindowIsUndefined) {
  const ProgrammeLoudness silent = programme_loudness(mono(std::vector<float>(48000)));
  EXPECT_EQ(silent.integrated_lufs, kSilence_lufs);
  for (const double lufs : silent.momentary_lufs) EXPECT_TRUE(std::isinf(lufs) && lufs < 0);
  const ProgrammeLoudness brief = programme_loudness(mono(sine(1000, 1, 0.39)));
  EXPECT_EQ(brief.integrated_lufs, kSilence_lufs);
  EXPECT_TRUE(brief.momentary_lufs.empty());
}

}  // namespace
}  // namespace clamor
