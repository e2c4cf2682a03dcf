// mixer_interpolation_test.cpp: the errors of interpolation that mix_kernel.h documents.
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/mixing/mixer.h"
#include "tests/rooms.h"
#include "tests/runtime/mixer_voices.h"

namespace clamor {
namespace {

using testing::voice;

// Error of interpolation for a tone, measured through the mixer. The gain is lowest half-way
// between two frames; the mean over all fractions is the gain of a moving voice, and the deviations
// from it are its aliases.
struct Interpolated {
  double half_way_db, mean_db, alias_db;
};
Interpolated interpolated(double frequency_hz, Interpolation interpolation) {
  constexpr int kFractions = 16;
  const MixMode mode{interpolation, 1, false};
  const auto signals = prepare_signals(std::vector<Signal>{testing::sine(frequency_hz)}, mode);
  std::array<std::complex<double>, kFractions> gains;
  for (int i = 0; i < kFractions; ++i) {
    const double delay = 100 + 1.0 * i / kFractions;
    Keyframe keyframe;
    keyframe.voices = {voice(0, delay, 1)};
    Mixer mixer(signals, 1, mode);
    mixer.begin(keyframe, 0);
    keyframe.voices[0].starts = false;
    std::complex<double> sum = 0;
    std::vector<float> block(kEars * kStepFrames);
    constexpr int kFrames = 9600;  // whole periods
    for (int n = 0; n < kFrames; n += kStepFrames) {
      if (mixer.wants_keyframe()) mixer.load(keyframe);
      mixer.step(block.data());
      for (int f = 0; f < kStepFrames; ++f)
        sum += static_cast<double>(block[static_cast<std::size_t>(kEars * f)]) *
               std::polar(1.0,
                          -2 * std::numbers::pi * frequency_hz * (n + f - delay) / kSampleRate_hz);
    }
    gains[static_cast<std::size_t>(i)] = sum * 2.0 / (0.5 * kFrames) * std::complex<double>(0, 1);
  }
  std::complex<double> mean = 0;
  for (const auto& gain : gains) mean += gain / (1.0 * kFractions);
  double images = 0;
  for (const auto& gain : gains) images += std::norm(gain - mean) / kFractions;
  return {20 * std::log10(std::abs(gains[kFractions / 2])), 20 * std::log10(std::abs(mean)),
          10 * std::log10(images)};
}

TEST(MixerInterpolation, HasTheDocumentedErrors) {
  struct Case {
    double hz, half_way_db, mean_db, alias_db;
  };
  const auto expect = [](Interpolation interpolation, const Case& c) {
    const Interpolated found = interpolated(c.hz, interpolation);
    EXPECT_NEAR(found.half_way_db, c.half_way_db, 0.01 + 0.03 * std::abs(c.half_way_db)) << c.hz;
    EXPECT_NEAR(found.mean_db, c.mean_db, 0.01 + 0.03 * std::abs(c.mean_db)) << c.hz;
    EXPECT_NEAR(found.alias_db, c.alias_db, 1) << c.hz;
  };
  // The values are those of the table in mix_kernel.h.
  for (const Case& c : {Case{1000, 0, 0, -131.4}, Case{2000, 0, 0, -107.1},
                        Case{4000, -0.002, -0.001, -82.3}, Case{8000, -0.035, -0.019, -55.6},
                        Case{12000, -0.244, -0.127, -38.2}, Case{16000, -1.160, -0.579, -24.6}})
    expect(Interpolation::kCubic, c);
  for (const Case& c : {Case{1000, -0.019, -0.012, -63.7}, Case{4000, -0.301, -0.198, -39.6},
                        Case{8000, -1.249, -0.798, -27.3}, Case{16000, -6.021, -3.288, -14.8}})
    expect(Interpolation::kLinear, c);
}

}  // namespace
}  // namespace clamor
