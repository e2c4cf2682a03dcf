// band_mix_test.cpp: upper bounds from the bands of a source and the levels of a signal in them.
#include "runtime/propagation/band_mix.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "bake/octree/octree_builder.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/query/octree_pool.h"
#include "tests/runtime/random_fractions.h"
#include "tests/runtime/syllables.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

float shown(const BandShares& shares, std::size_t band) {
  return shares.share * static_cast<float>(shares.parts[band]) / BandShares::kWhole;
}

TEST(BandMix, IsATightUpperBoundOfItsParts) {
  for (std::uint32_t seed = 0; seed < 1000; ++seed) {
    const Bands parts = testing::random_fractions(seed);
    const BandMix mix = BandMix::from_packed(BandMix::at_least(parts).packed());
    for (std::size_t b = 0; b < kBandCount; ++b) {
      EXPECT_GE(mix.part(b), parts[b]);
      EXPECT_LE(std::sqrt(mix.part(b)), std::sqrt(parts[b]) + 1.001f / 15);
    }
  }
  for (std::size_t b = 0; b < kBandCount; ++b) {
    EXPECT_EQ(BandMix::at_least({}).part(b), 0);
    EXPECT_EQ(BandMix::at_least(same_in_all_bands(1)).part(b), 1);
    EXPECT_EQ(BandMix::at_least(same_in_all_bands(std::nanf(""))).part(b), 1);
  }
}

TEST(BandMix, OfSharesNeverExceedsTheLargestShare) {
  for (std::uint32_t seed = 0; seed < 1000; ++seed) {
    const Bands parts = testing::random_fractions(seed),
                shares = testing::random_fractions(seed + 5000);
    float sum = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) sum += parts[b] * shares[b];
    const float most = *std::max_element(shares.begin(), shares.end());
    const float of = BandMix::at_least(parts).of(shares);
    EXPECT_GE(of, std::min(sum, most) * (1 - 1e-6f));
    EXPECT_LE(of, most);
  }
}

TEST(BandShares, AreUpperBounds) {
  for (std::uint32_t seed = 0; seed < 1000; ++seed) {
    const Bands shares = testing::random_fractions(seed);
    const BandShares bytes = BandShares::at_least(shares);
    EXPECT_EQ(bytes.share, *std::max_element(shares.begin(), shares.end()));
    for (std::size_t b = 0; b < kBandCount; ++b) {
      EXPECT_GE(shown(bytes, b), shares[b] * (1 - 1e-6f));
      EXPECT_LE(shown(bytes, b), shares[b] + bytes.share * 1.001f / 255);
    }
  }
  EXPECT_EQ(BandShares::at_least({}).share, 0);
}

// Weights at a time as fractions of their maxima.
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

TEST(SignalWeights, ByDelayBoundTheLevelForEveryDelayInTheBin) {
  const TimedEnvelope sound = testing::syllables(1);
  constexpr double kPerS = 50;
  for (const bool loop : {true, false})
    // Moments of nominal length, and those of a loop whose length is not a whole number of them.
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
              ASSERT_GE(shown(by_delay[d], b), expected[b]) << loop << give_s << " " << d;
              excess += shown(by_delay[d], b) - expected[b];
              sum += expected[b];
            }
          }
        }
        EXPECT_LT(excess, 0.15 * sum) << loop << give_s;
      }
}

TEST(SignalWeights, ByDelayAreMaximalForUnknownDelays) {
  const TimedEnvelope sound = testing::syllables(1);
  std::vector<BandShares> by_delay(3);
  track_of(sound, sound.frames, true).shares_by_delay(1, 50, 0.1, by_delay);
  for (const BandShares& shares : by_delay)
    for (std::size_t b = 0; b < kBandCount; ++b) EXPECT_EQ(shown(shares, b), 1);
}

TEST(SignalWeights, AheadBoundTheLevelUntilThen) {
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
    // The bound has steps of 160 ms and treats each band by itself.
    EXPECT_LT(excess, 0.3 * sum);
  }
}

// A float errs by 0.1 ms after an hour and by 4 ms after a day.
TEST(SignalWeights, SeenAheadHoldForAnEmitterThatBeginsAfterADay) {
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

// The bands of these signals come and go separately. A pool that bounds by the loudest band alone
// finds half as many sources again.
TEST(OctreePool, FindsLittleMoreThanReachesTheThresholdNow) {
  const std::vector<Emitter> emitters(1);
  const std::vector<Material> materials(1);
  const RadiationModel field(emitters, materials, Air{});
  const std::vector<TimedEnvelope> sounds = {testing::syllables(3)};
  const SignalWeights weights = make_signal_weights(sounds);
  std::vector<Source> sources(30'000);
  for (std::uint32_t i = 0; i < sources.size(); ++i) {
    const RandomBits a = philox(8, {i, 0, 0, 0}), b = philox(8, {i, 1, 0, 0});
    sources[i].position_m =
        Vec3f(static_cast<float>(20 * unit(a[0])), 0, static_cast<float>(20 * unit(a[1])));
    sources[i].normal = sources[i].mirror = Vec3f(0, 1, 0);
    sources[i].delay_s = static_cast<float>(0.05 + unit(a[2]));
    sources[i].u = static_cast<float>(unit_above_zero(a[3]));
    sources[i].power[b[0] % 2 == 0 ? 1 : 6] = static_cast<float>(std::pow(10, -3 * unit(b[1])));
  }
  testing::StoredTrees trees;
  trees.add(build_octree(std::move(sources)));
  PageLoader loader(trees.fetch(field, weights), PageBudget{1'000'000'000});
  OctreePool pool(field, weights, trees.tops(), {}, loader);
  constexpr double kThreshold = 0.1;
  std::size_t found_in_all = 0, reach = 0;
  for (int i = 0; i < 50; ++i) {
    const Vec3 place(6 + 0.03 * i, 1.7, 9);
    const double time_s = 4 + 0.02 * i;
    std::vector<FoundSource> found;
    do {
      found.clear();
      pool.refresh();
      pool.begin(place, time_s);
      ASSERT_TRUE(pool.look(place, kThreshold, std::numeric_limits<std::size_t>::max(), found));
      pool.ask(place, kThreshold);
    } while (!pool.complete());
    if (i < 10) continue;  // caches fill
    found_in_all += found.size();
    for (const FoundSource& one : found) {
      const auto now = weights_at_place(field, weights, one.signal, *one.source, place, time_s);
      const double priority = weight(field, now.weights, *one.source, place) * one.boost /
                              static_cast<double>(one.source->u);
      reach += priority >= kThreshold;
    }
  }
  EXPECT_GT(reach, 10'000u);
  EXPECT_LT(static_cast<double>(found_in_all), 1.15 * static_cast<double>(reach));
}

}  // namespace
}  // namespace clamor
