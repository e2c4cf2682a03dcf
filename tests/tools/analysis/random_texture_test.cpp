#include "tools/analysis/random_texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tools/analysis/test_sounds.h"
#include "tools/analysis/null_distribution.h"
#include "tools/analysis/sound_comparison.h"

namespace clamor {
namespace {

using testing::later;
using testing::noise;
using testing::plus;
using testing::stereo;
using testing::times;

constexpr auto kProgramme = SoundKind::kProgramme;
const std::vector<Measure> kTextureMeasures = {Measure::kIntegratedLoudness,
                                               Measure::kMomentaryLoudness,
                                               Measure::kSpectrum,
                                               Measure::kIld,
                                               Measure::kIacc,
                                               Measure::kRenormalisedL2};

// A crowd-like texture: brown below and white above, with a swelling envelope and partly coherent
// ears.
Sound crowd(std::uint64_t seed, double seconds) {
  std::array<std::vector<float>, 3> parts;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    parts[p] = noise(3 * seed + p, 0.1, seconds);
    float low = 0;
    for (std::size_t i = 0; i < parts[p].size(); ++i) {
      low += 0.1f * (parts[p][i] - low);
      const double turns = static_cast<double>(i) / kSampleRate_hz;
      parts[p][i] = (low + 0.2f * parts[p][i]) *
                    static_cast<float>(1 + 0.5 * std::sin(2 * std::numbers::pi * turns));
    }
  }
  return stereo(plus(parts[0], times(parts[1], 0.7)),
                plus(later(parts[0], 9), times(parts[2], 0.5)));
}

double size_of(const std::vector<Difference>& differences, Measure measure) {
  for (const Difference& difference : differences)
    if (difference.info->measure == measure) return difference.size();
  ADD_FAILURE();
  return 0;
}

TEST(RandomTexture, KeepsLevelSpectrumEnvelopeAndCoherenceButNoWaveform) {
  const Sound sound = crowd(1, 4);
  const Sound roll = RandomTexture(sound).roll(1, 0);
  ASSERT_EQ(roll.channels.size(), 2u);
  ASSERT_EQ(roll.frames(), sound.frames());
  const auto a = analyse(sound, kProgramme), b = analyse(roll, kProgramme);
  EXPECT_NEAR(a.loudness.integrated_lufs, b.loudness.integrated_lufs, 0.2);
  // Bands of w Hz in 4 s have a standard deviation of 4.34 sqrt(2 / 4 w) dB; the tolerance is three
  // of them, from 1 kHz.
  for (std::size_t band = 15; band < kErbBandCount; ++band)
    EXPECT_NEAR(10 * std::log10(a.spectrum[band] / b.spectrum[band]), 0, 0.8) << band;
  for (std::size_t i = 0; i < a.loudness.momentary_lufs.size(); ++i)
    EXPECT_NEAR(a.loudness.momentary_lufs[i], b.loudness.momentary_lufs[i], 1.2) << i;
  for (std::size_t octave = 3; octave < kBandCount; ++octave) {
    EXPECT_NEAR(*a.binaural.ild_db[octave], *b.binaural.ild_db[octave], 0.5);
    // The tolerance is three standard errors of the phase at 500 Hz.
    EXPECT_NEAR(*a.binaural.itd_s[octave], *b.binaural.itd_s[octave],
                0.07 / (2 * std::numbers::pi * kBandCentres_hz[octave]));
    EXPECT_NEAR(*a.binaural.iacc[octave], *b.binaural.iacc[octave], 0.06);
  }
  EXPECT_NEAR(size_of(compare(a, b), Measure::kCorrelation), 0, 0.05);
}

TEST(RandomTexture, DependsOnlyOnItsSeed) {
  const RandomTexture texture(crowd(1, 0.3));
  EXPECT_EQ(texture.roll(1, 5).channels, texture.roll(1, 5).channels);
  EXPECT_NE(texture.roll(1, 5).channels, texture.roll(1, 6).channels);
  EXPECT_NE(texture.roll(1, 5).channels, texture.roll(2, 5).channels);
  const Sound mono = RandomTexture(testing::mono(noise(1, 0.1, 0.3))).roll(1, 1);
  EXPECT_EQ(mono.channels.size(), 1u);
  for (const Sound& silent : {RandomTexture(testing::mono(std::vector<float>(5000))).roll(1, 1),
                              RandomTexture(testing::mono({0.0f})).roll(1, 1)})
    for (const float x : silent.channels[0]) EXPECT_EQ(x, 0);
}

// The reference is many exact renderings of one process; a recording is one of them.
TEST(RandomTexture, DiffersFromItsLikeAsMuchAsExactRenderingsDo) {
  constexpr int kRolls = 40;
  constexpr double kLength_s = 0.8;
  const auto pairs = [&](const std::function<Sound(std::uint32_t)>& render) {
    std::vector<std::vector<Difference>> rolls(kRolls);
    (void)null_distribution(kRolls, [&](std::uint32_t roll) {
      rolls[roll] =
          compare(analyse(render(2 * roll), kProgramme), analyse(render(2 * roll + 1), kProgramme));
      return rolls[roll];
    });
    return rolls;
  };
  const RandomTexture texture(crowd(1, kLength_s));
  const auto guessed = pairs([&](std::uint32_t i) { return texture.roll(7, i); });
  const auto exact = pairs([&](std::uint32_t i) { return crowd(100 + i, kLength_s); });
  const NullDistribution yardstick(guessed);
  for (const Measure measure : kTextureMeasures) {
    const char* const key = kMeasures[static_cast<std::size_t>(measure)].key;
    double mean_guessed = 0, mean_exact = 0;
    int inside = 0;
    for (int i = 0; i < kRolls; ++i) {
      mean_guessed += size_of(guessed[i], measure) / kRolls;
      mean_exact += size_of(exact[i], measure) / kRolls;
      inside += size_of(exact[i], measure) <= yardstick.size_95(measure);
    }
    // The mean of 40 sizes that vary by 60 % has an error of 9 %, and two means of 13 %.
    EXPECT_NEAR(mean_guessed / mean_exact, 1, 0.25) << key;
    EXPECT_GE(inside, 33) << key;  // 38 expected, minus 3 x 1.4 by chance
  }
}

}  // namespace
}  // namespace clamor
