#include "runtime/mixing/limiter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "common/sample_rate.h"
#include "runtime/mixing/panner.h"
#include "runtime/output/loudness_meter.h"

namespace clamor {
namespace {

std::vector<float> white_noise(std::size_t samples, float most, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-most, most);
  std::vector<float> result(samples);
  for (float& x : result) x = uniform(random);
  return result;
}

// Limits blocks of `block_frames` frames and removes the limiter's delay from the result.
std::vector<float> limited(Limiter& limiter, std::vector<float> samples, std::size_t channels,
                           std::size_t block_frames) {
  for (std::size_t i = 0; i < channels * kLimiterDelayFrames; ++i) samples.push_back(0);
  for (std::size_t at = 0; at < samples.size(); at += channels * block_frames)
    limiter.process(
        std::span(samples).subspan(at, std::min(channels * block_frames, samples.size() - at)));
  samples.erase(samples.begin(),
                samples.begin() + static_cast<std::ptrdiff_t>(channels * kLimiterDelayFrames));
  return samples;
}

// Largest magnitude of the band-limited signal through the samples, by sinc interpolation at 16
// points between them.
double true_peak(const std::vector<float>& samples, std::size_t channels, std::size_t channel) {
  double peak = 0;
  const auto frames = static_cast<std::ptrdiff_t>(samples.size() / channels);
  for (std::ptrdiff_t n = 100; n < frames - 100; ++n)
    for (int step = 0; step < 16; ++step) {
      double sum = 0;
      for (std::ptrdiff_t k = -48; k <= 48; ++k) {
        const double x = step / 16.0 - static_cast<double>(k);
        const double sinc = x == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
        sum += static_cast<double>(samples[static_cast<std::size_t>(n + k) * channels + channel]) *
               sinc * std::pow(std::cos(std::numbers::pi / 2 * x / 50), 2);
      }
      peak = std::max(peak, std::abs(sum));
    }
  return peak;
}

TEST(Limiter, ChangesNoBitBelowTheThreshold) {
  for (const std::size_t channels : {1u, 2u, 12u}) {
    Limiter limiter(channels);
    const std::vector<float> in = white_noise(channels * 4000, 0.5f);
    EXPECT_EQ(limited(limiter, in, channels, 100), in);
    EXPECT_EQ(limiter.worked().frames, 0u);
    EXPECT_EQ(limiter.worked().min_gain, 1);
  }
}

TEST(Limiter, KeepsTruePeaksBelowFullScaleAndCountsItsFrames) {
  // A tone at a quarter of the sample rate, in the phase whose samples are 3 dB below the peaks
  // between them: no sample reaches 1. The others are noise far above full scale and a single
  // click.
  std::vector<std::vector<float>> sounds(1);
  for (int n = 0; n < 3000; ++n)
    sounds[0].push_back(
        static_cast<float>(1.35 * std::sin(std::numbers::pi / 2 * n + std::numbers::pi / 4)));
  // The noise is low-passed: next to the Nyquist frequency, where there is no sound anyway, so
  // short a filter misses peaks between samples.
  sounds.push_back(white_noise(3001, 8));
  for (std::size_t n = 0; n < 3000; ++n) sounds.back()[n] += sounds.back()[n + 1];
  sounds.push_back(white_noise(3000, 0.01f));
  sounds.back()[1500] = 5;
  for (const std::vector<float>& in : sounds) {
    Limiter limiter(1);
    const std::vector<float> out = limited(limiter, in, 1, 64);
    EXPECT_LE(true_peak(out, 1, 0), 1);
    for (const float sample : out) EXPECT_LE(std::abs(sample), 0.8914f);  // -1 dBFS
    EXPECT_GT(limiter.worked().frames, 50u);
    EXPECT_LT(limiter.worked().min_gain, 0.9f);
  }
}

TEST(Limiter, ReturnsToUnityGainAndNeverChangesItFast) {
  std::vector<float> in(2 * 60000, 0.25f);
  in[2 * 1000] = 4;  // in the left channel
  Limiter limiter(2);
  const std::vector<float> out = limited(limiter, in, 2, 300);
  for (std::size_t f = 0; f < 60000; ++f) {
    const float same = f == 1000 ? out[2 * f + 1] : out[2 * f];
    ASSERT_EQ(same, out[2 * f + 1]) << "both channels have the same gain";
    // The gain falls linearly within 66 frames and rises by 3 dB in 100 ms.
    if (f == 0) continue;
    EXPECT_LT(out[2 * f - 1] - out[2 * f + 1], 0.25f / 60) << f;
    EXPECT_LT(out[2 * f + 1] / out[2 * f - 1], 1.0001f) << f;
  }
  EXPECT_LT(out[2 * 1000 + 1], 0.06f);
  // The release from 13 dB takes 0.43 s.
  for (std::size_t f = 1000 + 22000; f < 60000; ++f) EXPECT_EQ(out[2 * f], 0.25f) << f;
}

TEST(Limiter, DoesNotDependOnBlockSizes) {
  const std::vector<float> in = white_noise(2 * 5000, 3, 7);
  Limiter first(2), second(2);
  EXPECT_EQ(limited(first, in, 2, 5000), limited(second, in, 2, 37));
}

}  // namespace
}  // namespace clamor
