#include "runtime/output/loudness_meter.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "common/sample_rate.h"
#include "runtime/mixing/panner.h"

namespace clamor {
namespace {

// A sine of 997 Hz at full scale is -3.01 LUFS in one channel and 0 LUFS in two (BS.1770-4), 1.5 dB
// more in a surround channel, and nothing in LFE. The omnidirectional channel of ambisonics counts
// twice.
TEST(LoudnessMeter, MeasuresASineAsBs1770Says) {
  const std::vector<Speaker> surround = find_layout("5.1")->order();
  struct Case {
    std::vector<Speaker> speakers;
    int channels;
    std::vector<int> sounding;
    double expected_lufs;
  };
  for (const auto& [speakers, channels, sounding, expected] :
       {Case{{}, 2, {0}, -3.01}, Case{{}, 2, {0, 1}, 0}, Case{surround, 6, {2}, -3.01},
        Case{surround, 6, {4}, -1.52}, Case{{}, 16, {0}, 0}}) {
    LoudnessMeter meter(channels, speakers);
    std::vector<float> block(static_cast<std::size_t>(channels) * 480);
    for (int n = 0; n < 4 * kSampleRate_hz; n += 480) {
      for (int f = 0; f < 480; ++f) {
        const double sine = std::sin(2 * std::numbers::pi * 997 * (n + f) / kSampleRate_hz);
        for (const int c : sounding)
          block[static_cast<std::size_t>(f * channels + c)] = static_cast<float>(sine);
      }
      meter.add(block);
    }
    EXPECT_NEAR(meter.momentary_lufs(), expected, 0.1);
    EXPECT_NEAR(meter.short_term_lufs(), expected, 0.1);
  }
  LoudnessMeter silent(6, surround);
  std::vector<float> effects(6 * kSampleRate_hz);
  for (std::size_t f = 0; f < kSampleRate_hz; ++f) effects[6 * f + 3] = f % 2 == 0 ? 1 : -1;
  silent.add(effects);
  EXPECT_LT(silent.momentary_lufs(), -100);
}

}  // namespace
}  // namespace clamor
