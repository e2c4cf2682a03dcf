// loudness_bounds_test.cpp: upper bounds of a signal's level by delay and ahead of time, in
// signal_weights.h.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/propagation/signal_weights.h"
#include "tests/runtime/random_fractions.h"
#include "tests/runtime/syllables.h"

namespace clamor {
namespace {

float share_in_band(const BandShares& shares, std::size_t band) {
  return shares.share * static_cast<float>(shares.parts[band]) / BandShares::kWhole;
}

// Levels at a time, as shares of the maximum of each band.
Bands shares_at(const LoudnessTrack& track, double time_s) {
  Bands shares = track.at(time_s).weights;
  for (std::size_t b = 0; b < kBandCount; ++b)
    shares[b] = track.max()[b] > 0 ? shares[b] / track.max()[b] : 0;
  return shares;
}

void raise(Bands& most, const Bands& to) {
  for (std::size_t b = 0; b < kBandCount; ++b) most[b] = std::max(most[b], to[b]);
}

LoudnessTrack track_of(const TimedEnvelope& timed, std::uint64_t frames, bool loop) {
  return {timed.envelope, frames, loop, same_in_all_bands(1), {}};
}

TEST(SignalWeights, ByDelayBoundTheLevelForEveryDelayInTheBin_NoAsan) {
  const TimedEnvelope sound = testing::syllables(1);
  constexpr double kPerS = 50;
  for (const bool loop : {true, false})
    // Whole moments, and a loop that is not a multiple of a moment.
    for (const std::uint64_t frames : {sound.frames, sound.frames - 900})
      for (const double give_s : {0.0, 0.009, 0.025}) {
        const LoudnessTrack track = track_of(sound, frames, loop);
        double excess = 0, sum = 0;
        for (std::uint32_t i = 0; i < 40; ++i) {
          const double time_s = 8 * unit(philox(6, {i, 0, 0, 0})[0]) - 2;
          std::vector<BandShares> by_delay(150);
          track.shares_by_delay(time_s, kPerS, give_s, by_delay);
          for (std::size_t d = 0; d < by_delay.size(); ++d) {
            Bands expected{};
            for (double off = -give_s; off <= 1 / kPerS + give_s; off += 0.001)
              raise(expected, shares_at(track, time_s - static_cast<double>(d) / kPerS - off));
            for (std::size_t b = 0; b < kBandCount; ++b) {
              ASSERT_GE(share_in_band(by_delay[d], b), expected[b]) << loop << give_s << " " << d;
              excess += share_in_band(by_delay[d], b) - expected[b];
              sum += expected[b];
            }
          }
        }
        EXPECT_LT(excess, 0.15 * sum) << loop << give_s;
      }
}

TEST(SignalWeights, ByDelayAreMaximalForUnknownDelays_NoAsan) {
  const TimedEnvelope sound = testing::syllables(1);
  std::vector<BandShares> by_delay(3);
  track_of(sound, sound.frames, true).shares_by_delay(1, 50, 0.1, by_delay);
  for (const BandShares& shares : by_delay)
    for (std::size_t b = 0; b < kBandCount; ++b) EXPECT_EQ(share_in_band(shares, b), 1);
}

TEST(SignalWeights, AheadBoundTheLevelUntilThen_NoAsan) {
  const TimedEnvelope sound = testing::syllables(1);
  for (const bool loop : {true, false}) {
    const LoudnessTrack track = track_of(sound, sound.frames, loop);
    double excess = 0, sum = 0;
    for (std::uint32_t i = 0; i < 2000; ++i) {
      const RandomBits bits = philox(4, {i, 0, 0, 0});
      const double time_s = 6 * unit(bits[0]) - 1, ahead_s = 0.6 * unit(bits[1]);
      const auto delay_s = static_cast<float>(1.5 * unit(bits[2]));
      const float give_s = 0.002f;
      const BandMix mix = BandMix::at_least(testing::random_fractions(i));
      const float most = track.max_share(mix, time_s, delay_s, give_s, ahead_s);
      float expected = 0;
      for (double t = 0; t <= ahead_s; t += 0.005)
        for (const float off_s : {-give_s, 0.0f, give_s})
          expected = std::max(expected, mix.of(shares_at(track, time_s + t - delay_s - off_s)));
      ASSERT_GE(most, expected) << i;
      excess += most - expected;
      sum += expected;
    }
    // Levels ahead are known in steps of 160 ms and separately for each band.
    EXPECT_LT(excess, 0.3 * sum);
  }
}

// The rounding error of a float is a tenth of a millisecond after an hour and four after a day.
TEST(SignalWeights, AheadHoldForAnEmitterThatStartsAfterADay_NoAsan) {
  const TimedEnvelope sound = testing::syllables(1);
  const LoudnessTrack track = track_of(sound, sound.frames, false);
  for (const double begins_s : {0.0, 3600.0, 80'000.0})
    for (std::uint32_t i = 0; i < 40'000; ++i) {
      const RandomBits bits = philox(9, {i, 0, 0, 0});
      const double delay_s = begins_s + 0.5 * unit(bits[0]);
      const double time_s = delay_s + 6 * unit(bits[1]) - 0.5;
      const BandMix mix = BandMix::at_least(testing::random_fractions(i));
      const float most =
          track.max_share(mix, time_s, static_cast<float>(delay_s), 4e-6f, 0.5 * unit(bits[2]));
      ASSERT_GE(most, mix.of(shares_at(track, time_s - delay_s))) << begins_s << " " << i;
    }
  Bands whole;
  whole.fill(1);
  const BandMix mix = BandMix::at_least(testing::random_fractions(1));
  for (const float delay_s : {std::numeric_limits<float>::infinity(), std::nanf(""), -1e30f})
    EXPECT_GE(track.max_share(mix, 1, delay_s, 4e-6f, 0.1), mix.of(whole)) << delay_s;
}

}  // namespace
}  // namespace clamor
