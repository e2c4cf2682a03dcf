#include "tools/analysis/time_varying_part.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tools/analysis/test_sounds.h"

namespace clamor {
namespace {

using testing::decaying;
using testing::mono;
using testing::noise;
using testing::plus;
using testing::stereo;
using testing::times;

// Convolution with a fixed decaying filter of 50 ms.
std::vector<float> through_a_room(const std::vector<float>& dry, std::uint64_t seed) {
  const auto response = decaying(seed, 0.05, 0.05);
  std::vector<float> wet(dry.size());
  for (std::size_t n = 0; n < dry.size(); ++n)
    for (std::size_t k = 0; k < std::min(response.size(), n + 1); ++k)
      wet[n] += response[k] * dry[n - k];
  return wet;
}

TEST(TimeVaryingPart, OfAFixedFilterIsZeroInBothEars) {
  const auto dry = noise(1, 0.1, 1);
  const auto parts =
      time_varying_part_db(dry, stereo(through_a_room(dry, 2), through_a_room(dry, 3)), 0.1);
  EXPECT_LT(parts[0].value(), -55);
  EXPECT_LT(parts[1].value(), -55);
}

// y = (1 + m sin(2 pi f t)) x: the best filter is x itself and leaves m^2 / 2 of 1 + m^2 / 2. No
// filter predicts independent noise of power p beside a signal of power 1: p / (1 + p).
TEST(TimeVaryingPart, OfAModulatedGainAndOfOtherNoiseIsTheClosedForm) {
  const auto dry = noise(1, 0.1, 3);
  for (const double depth : {0.5, 0.1}) {
    auto modulated = dry;
    for (std::size_t i = 0; i < modulated.size(); ++i)
      modulated[i] *= static_cast<float>(
          1 + depth * std::sin(2 * std::numbers::pi * 4 * static_cast<double>(i) / 48000));
    const double share = depth * depth / 2;
    const auto parts = time_varying_part_db(
        dry, stereo(modulated, plus(dry, times(noise(2, 0.1, 3), depth))), 0.1);
    // 140 000 samples determine a power to 0.02 dB; the whole periods after the first 0.1 s do not.
    EXPECT_NEAR(parts[0].value(), 10 * std::log10(share / (1 + share)), 0.3) << depth;
    EXPECT_NEAR(parts[1].value(), 10 * std::log10(2 * share / (1 + 2 * share)), 0.1) << depth;
  }
}

TEST(TimeVaryingPart, OfShortOrSilentSoundsIsUndefined) {
  const auto dry = noise(1, 0.1, 1), silence = times(dry, 0);
  EXPECT_FALSE(time_varying_part_db(dry, mono(dry), 0.3)[0].has_value());
  EXPECT_FALSE(time_varying_part_db(silence, mono(dry), 0.1)[0].has_value());
  const auto parts = time_varying_part_db(dry, stereo(silence, dry), 0.1);
  EXPECT_FALSE(parts[0].has_value());
  EXPECT_LT(parts[1].value(), -55);
}

}  // namespace
}  // namespace clamor
