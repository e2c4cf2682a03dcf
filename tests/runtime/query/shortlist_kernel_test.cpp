// shortlist_kernel_test.cpp: sources of a shortlist that exceed the threshold, on every instruction
// set.
#include "runtime/query/shortlist_kernel.h"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "tests/runtime/instruction_sets.h"
#include "tests/runtime/scattered_sources.h"
#include "tests/runtime/source_bound_reference.h"
#include "tests/runtime/syllables.h"

namespace clamor {
namespace {

constexpr std::uint32_t kListed = 300, kSounds = 5;
constexpr float kLongest_s = 1.5f;

using ShortlistKernel = testing::OnInstructionSet;
INSTANTIATE_TEST_SUITE_P(EveryInstructionSet, ShortlistKernel, testing::every_instruction_set(),
                         testing::instruction_set_name);

// Some sources have delays outside the table.
std::vector<ShortlistBlock> some_list(std::uint32_t seed) {
  std::vector<ShortlistBlock> blocks;
  for (std::uint32_t i = 0; i < kListed; ++i) {
    const RandomBits a = philox(seed, {i, 0, 0, 0}), b = philox(seed, {i, 1, 0, 0});
    const std::size_t at = i % kCullBlock;
    if (at == 0) blocks.emplace_back().upper_bound.fill(-1);
    ShortlistBlock& block = blocks.back();
    block.upper_bound[at] = static_cast<float>(std::pow(2.0, 12 * unit(a[0])));
    block.delay_s[at] = static_cast<float>(2 * unit(a[1]) - 0.1);
    block.signal[at] = a[2] % kSounds;
    block.source[at] = i;
    block.mix[at] = BandMix::from_packed(b[0] & b[1]);
  }
  return blocks;
}

// Looks up the table for each band.
float share_of(const LoudnessTable& table, const ShortlistBlock& block, std::size_t at) {
  const float delay_s = block.delay_s[at];
  const auto row = static_cast<std::size_t>(block.signal[at]) * table.row();
  const auto last = static_cast<float>(table.row() - 1);
  const float column = std::clamp(std::floor(delay_s * LoudnessTable::kPerS) + 1, 0.0f, last);
  const BandShares& now = table.data()[row + static_cast<std::size_t>(column)];
  Bands shares;
  for (std::size_t b = 0; b < kBandCount; ++b)
    shares[b] = now.share * static_cast<float>(now.parts[b]) / BandShares::kWhole;
  return block.mix[at].of(shares);
}

TEST_P(ShortlistKernel, FindsSourcesAboveTheThresholdByTheirOwnBands) {
  std::vector<TimedEnvelope> sounds;
  for (std::uint32_t s = 0; s < kSounds; ++s) sounds.push_back(testing::syllables(s));
  const SignalWeights weights = make_signal_weights(sounds, {0, 0, 0});
  std::size_t found = 0, left_out = 0;
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    const std::vector<ShortlistBlock> blocks = some_list(seed);
    LoudnessTable table;
    table.tabulate(weights.tracks, 3 + 0.1 * seed, kLongest_s, 0.005f);
    AudibleEntries loud;
    loud.clear(kCullBlock * blocks.size());
    find_audible(blocks, 1, table, {}, loud);
    const std::size_t end = loud.count;
    std::size_t next = 0;
    for (std::uint32_t e = 0; e < kListed; ++e) {
      const ShortlistBlock& block = blocks[e / kCullBlock];
      const float share = share_of(table, block, e % kCullBlock);
      const float now = block.upper_bound[e % kCullBlock] * share;
      if (std::abs(now - 1) < 1e-5f) continue;  // either result is right
      if (now < 1) {
        ++left_out;
        continue;
      }
      while (next < end && loud.entry[next] < e) ++next;
      ASSERT_LT(next, end);
      ASSERT_EQ(loud.entry[next], e) << seed;
      ASSERT_NEAR(loud.share[next] / share, 1, 1e-5) << seed;
      ++found;
    }
    EXPECT_LE(end, found + 1);
  }
  EXPECT_GT(found, 3000u);
  EXPECT_GT(left_out, 3000u);
}

// The bound holds for any change of level in between.
TEST_P(ShortlistKernel, BoundsTheLevelNow) {
  std::vector<TimedEnvelope> sounds;
  for (std::uint32_t s = 0; s < kSounds; ++s) sounds.push_back(testing::syllables(s));
  const SignalWeights weights = make_signal_weights(sounds, {0, 0, 0});
  constexpr float kGive_s = 0.009f;
  std::size_t far_from_all = 0;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const double time_s = 2 + 0.031 * i;
    LoudnessTable table;
    table.tabulate(weights.tracks, time_s, 2, kGive_s);
    for (std::uint32_t j = 0; j < 500; ++j) {
      const RandomBits bits = philox(i, {j, 3, 0, 0});
      const std::uint32_t signal = bits[0] % kSounds;
      const auto delay_s = static_cast<float>(2 * unit(bits[1]));
      const double off_s = static_cast<double>(kGive_s) * (2 * unit(bits[2]) - 1);
      const double at_s = time_s - static_cast<double>(delay_s) - off_s;
      const auto column = static_cast<std::size_t>(delay_s * LoudnessTable::kPerS) + 1;
      const float share = table.data()[signal * table.row() + column].share;
      ASSERT_GE(share * (1 + 1e-6f), weights.tracks[signal].at(at_s).share) << i << " " << j;
      far_from_all += share < 0.5f;
    }
  }
  EXPECT_GT(far_from_all, 10'000u);
}

// One late sound must not give all others their maximum level.
TEST_P(ShortlistKernel, TabulatesTheUsualDelaysOfHundredsOfSignalsEvenIfSomeAreLate) {
  const std::vector<TimedEnvelope> sounds(400, testing::syllables(1));
  const SignalWeights weights = make_signal_weights(sounds, {0, 0, 0});
  LoudnessTable whole, cut;
  whole.tabulate(std::span(weights.tracks).first(kSounds), 3, 2, 0.005f);
  for (const float longest_s : {200.0f, 1e30f}) {
    cut.tabulate(weights.tracks, 3, longest_s, 0.005f);
    ASSERT_GE(cut.row(), 10 * LoudnessTable::kPerS);
    for (std::size_t s = 0; s < kSounds; ++s) {
      for (std::size_t d = 1; d + 1 < whole.row(); ++d)
        EXPECT_EQ(cut.data()[s * cut.row() + d].share, whole.data()[s * whole.row() + d].share);
      EXPECT_EQ(cut.data()[(s + 1) * cut.row() - 1].share, 1) << "later delays count as loud";
    }
  }
}

// There is no table for steady signals, nor where one would take too long to compute.
TEST_P(ShortlistKernel, FindsSourcesAboveTheThresholdWithoutATable) {
  const std::vector<ShortlistBlock> blocks = some_list(1);
  const std::vector<std::uint8_t> moment(kBandCount, 255);
  const std::vector<TimedEnvelope> sounds(
      20'000, {*SignalEnvelope::from_steps(same_in_all_bands(1), moment), kMomentFrames, true});
  LoudnessTable of_too_many;
  of_too_many.tabulate(make_signal_weights(sounds, {0, 0, 0}).tracks, 3, 70, 0.005f);
  ASSERT_EQ(of_too_many.row(), 0u);
  for (const LoudnessTable& table : {LoudnessTable(), of_too_many}) {
    AudibleEntries loud;
    loud.clear(kCullBlock * blocks.size());
    find_audible(blocks, 100, table, {}, loud);
    const std::size_t end = loud.count;
    std::size_t next = 0;
    for (std::uint32_t e = 0; e < kListed; ++e) {
      if (blocks[e / kCullBlock].upper_bound[e % kCullBlock] < 100) continue;
      ASSERT_LT(next, end);
      EXPECT_EQ(loud.entry[next], e);
      EXPECT_EQ(loud.share[next++], 1);
    }
    EXPECT_EQ(next, end);
  }
}

// The source relative to the listener, as in a shortlist.
SourceBound seen_from(const Vec3& place, const SourceBound& source) {
  SourceBound seen = source;
  seen.position_m = Vec3f(Vec3(source.position_m) - place);
  return seen;
}

// Shortlists evaluate the bounds of any number of sources at once.
TEST_P(ShortlistKernel, GivesTheSameBoundsToSourcesOfAShortlist) {
  const testing::ScatteredSources level(8, 300, 10, {1, 2, 3});
  const RadiationModel field(level.emitters, level.materials, Air{});
  const auto sources = level.bounds(field);
  for (const std::uint32_t count : {1u, 15u, 16u, 17u, 300u}) {
    const Vec3 place = Vec3(1, 2, 3) + 12.0 * testing::direction(philox(10, {count, 0, 0, 0}));
    std::vector<SourceBound> seen(count + kCullBlock);
    for (std::size_t s = 0; s < count; ++s) seen[s] = seen_from(place, sources[s]);
    std::vector<float> ceilings(count + kCullBlock);
    upper_bounds_at(seen.data(), count, 0, ceilings.data());
    for (std::size_t s = 0; s < count; ++s) {
      const double expected = testing::priority_upper_bound(sources[s], place);
      const double in_front =
          testing::priority_upper_bound(sources[s], Vec3(sources[s].position_m));
      EXPECT_GE(ceilings[s], expected * (1 - 1e-6)) << s;
      EXPECT_LE(ceilings[s], expected * testing::kMaxBoundExcess * 1.01 + 1e-7 * in_front) << s;
    }
  }
}

// The bounds allow for sources that are displaced by up to `off_m`, like those of instances far
// from the origin in single precision, and for a listener who walks on.
TEST_P(ShortlistKernel, BoundsSourcesOfAShortlistThatAreDisplaced) {
  const testing::ScatteredSources level(11, 400, 1, {0, 0, 0});
  const RadiationModel field(level.emitters, level.materials, Air{});
  const auto sources = level.bounds(field);
  std::vector<SourceBound> seen(sources.size() + kCullBlock);
  std::vector<float> ceilings(seen.size());
  std::size_t close = 0;
  for (const float off_m : {1e-6f, 2e-3f, 0.04f})
    for (std::uint32_t i = 0; i < 100; ++i) {
      const RandomBits bits = philox(77, {i, 0, 0, 0});
      const Vec3 place = i % 5 == 0
                             ? Vec3(level.sources[i].position_m)
                             : std::pow(10, 2 * unit(bits[3]) - 1) * testing::direction(bits);
      std::vector<Vec3> at;
      for (std::uint32_t s = 0; s < sources.size(); ++s) {
        const SourceBound& source = sources[s];
        at.push_back(Vec3(source.position_m) +
                     0.99 * off_m * testing::direction(philox(12, {i, s, 0, 0})));
        seen[s] = seen_from(place, source);
      }
      upper_bounds_at(seen.data(), sources.size(), off_m, ceilings.data());
      for (std::size_t s = 0; s < sources.size(); ++s) {
        SourceBound there = sources[s];
        const double expected =
            testing::priority_upper_bound(there, place - (at[s] - Vec3(there.position_m)));
        ASSERT_GE(ceilings[s], expected * (1 - 1e-6)) << off_m << " " << i << " " << s;
        close += ceilings[s] < 1.1 * expected;
      }
    }
  EXPECT_GT(close, 20'000u);
}

}  // namespace
}  // namespace clamor
