#include "tools/analysis/texture_statistics.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "runtime/hrtf/erb_bands.h"
#include "tests/tools/analysis/test_sounds.h"

namespace clamor {
namespace {

using testing::noise;
using testing::sine;

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Frequency of a tone in the middle of a band.
double centre_hz(std::size_t band) { return erb_frequency_hz(2 + static_cast<double>(band)); }

TEST(TextureStatistics, OfGaussianNoiseAreThoseOfACompressedRayleighEnvelope) {
  // For r^0.3 of a Rayleigh variable r, E r^n = 2^(n/2) gamma(1 + n/2), so all moments have closed
  // forms.
  const auto moment = [](double n) { return std::pow(2, 0.15 * n) * std::tgamma(1 + 0.15 * n); };
  const double m1 = moment(1), m2 = moment(2), m3 = moment(3), m4 = moment(4);
  const double variance = m2 - m1 * m1;
  const double third = m3 - 3 * m1 * m2 + 2 * m1 * m1 * m1;
  const double fourth = m4 - 4 * m1 * m3 + 6 * m1 * m1 * m2 - 3 * m1 * m1 * m1 * m1;
  const TextureStatistics found = texture_statistics(noise(1, 0.1, 60));
  ASSERT_EQ(found.variation.size(), kTextureBands);
  // Below 1 kHz only: the envelope of a wider band is averaged over several independent samples at
  // 375 Hz.
  for (std::size_t b = 4; b < 13; ++b) {
    EXPECT_NEAR(found.variation[b], std::sqrt(variance) / m1, 0.012) << b;
    EXPECT_NEAR(found.skewness[b], third / std::pow(variance, 1.5), 0.2) << b;
    EXPECT_NEAR(found.kurtosis[b], fourth / (variance * variance), 0.5) << b;
  }
  EXPECT_NEAR(mean(found.correlation), 0, 0.02);
}

TEST(TextureStatistics, OfASteadyToneHaveNoVariation) {
  for (const std::size_t b : {6u, 16u, 28u})
    EXPECT_NEAR(texture_statistics(testing::times(sine(centre_hz(b), 1, 4), 0.1)).variation[b], 0,
                0.02)
        << b;
}

TEST(TextureStatistics, FindTheRateOfAPulsatingTone) {
  // Octaves from 1.46 Hz: 1.5 to 3, 3 to 6, 6 to 12, 12 to 23 Hz ...
  for (const auto& [rate_hz, octave] : {std::pair(4.4, 1u), {8.8, 2u}, {17.6, 3u}, {35.2, 4u}}) {
    auto tone = sine(centre_hz(18), 0.1, 6);
    for (std::size_t i = 0; i < tone.size(); ++i)
      tone[i] *= static_cast<float>(
          1 + 0.5 * std::sin(2 * std::numbers::pi * rate_hz * static_cast<double>(i) / 48000));
    const auto found = texture_statistics(tone).modulation_db;
    ASSERT_EQ(found.size(), kTextureBands * kModulationBands);
    for (std::size_t o = 0; o < kModulationBands; ++o)
      EXPECT_EQ(found[18 * kModulationBands + o] > -3, o == octave) << rate_hz << " Hz, " << o;
  }
}

TEST(TextureStatistics, DistinguishASparseTextureFromADenseOneOfTheSameSpectrum) {
  // 30 clicks of random sign per second are as white as noise.
  std::vector<float> clicks(10 * 48000);
  for (std::uint32_t i = 0; i < clicks.size(); ++i) {
    const RandomBits bits = philox(5, {i, 0, 0, 0});
    if (unit(bits[0]) < 30.0 / 48000) clicks[i] = bits[1] % 2 == 0 ? 0.5f : -0.5f;
  }
  const TextureStatistics sparse = texture_statistics(clicks);
  const TextureStatistics dense = texture_statistics(noise(6, 0.0125, 10));
  EXPECT_GT(mean(sparse.variation), 2 * mean(dense.variation));
  EXPECT_GT(mean(sparse.skewness), mean(dense.skewness) + 0.5);
  EXPECT_GT(mean(sparse.correlation), 0.3);
  EXPECT_LT(mean(dense.correlation), 0.05);
}

TEST(TextureStatistics, DoNotDependOnTheLevel) {
  const auto sound = noise(7, 0.1, 3);
  const TextureStatistics loud = texture_statistics(sound);
  const TextureStatistics soft = texture_statistics(testing::times(sound, 0.01));
  for (std::size_t b = 0; b < kTextureBands; ++b) {
    EXPECT_NEAR(loud.variation[b], soft.variation[b], 1e-5);
    EXPECT_NEAR(loud.kurtosis[b], soft.kurtosis[b], 1e-3);
  }
}

TEST(TextureStatistics, OfSilenceAndOfAMomentAreDefined) {
  EXPECT_TRUE(texture_statistics({}).variation.empty());
  EXPECT_TRUE(texture_statistics(noise(1, 0.1, 1.4)).variation.empty());
  const TextureStatistics silent = texture_statistics(std::vector<float>(96000));
  for (const auto* values : {&silent.variation, &silent.skewness, &silent.kurtosis,
                             &silent.modulation_db, &silent.correlation})
    for (const double value : *values) EXPECT_EQ(value, 0);
}

}  // namespace
}  // namespace clamor
