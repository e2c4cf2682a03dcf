// occlusion_upper_bounds_test.cpp: upper bounds of visibility, for one source and in the kernel for
// 16 sources.
#include "runtime/occlusion/occlusion_upper_bounds.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/query/shortlist_kernel.h"

namespace clamor {
namespace {

TEST(OcclusionUpperBounds, AreNeverBelowTheVisibility) {
  OcclusionUpperBounds hidden;
  std::map<std::uint64_t, float> shares;
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    const RandomBits bits = philox(9, {i, 0, 0, 0});
    const std::uint64_t number = std::uint64_t{bits[0] % 5000} * (bits[1] % 3 == 0 ? 1 : 7919);
    const auto share =
        bits[2] % 4 == 0 ? 0 : static_cast<float>(std::pow(2.0, -18 * unit(bits[3])));
    hidden.set(number, OcclusionUpperBounds::step_for(share));
    shares[number] = share;
  }
  hidden.begin_keyframe(true);
  for (const auto& [number, share] : shares) EXPECT_EQ(hidden.upper_bound(number), 1);
  hidden.begin_keyframe(false);
  for (const auto& [number, share] : shares) {
    const float most = hidden.upper_bound(number);
    if (OcclusionUpperBounds::phase_of(number) == hidden.phase()) {
      EXPECT_EQ(most, 1);
      continue;
    }
    EXPECT_GE(most, share);
    EXPECT_LE(most, std::max(2 * share, share > 0 ? 0x1p-14f : 0));
  }
  EXPECT_EQ(hidden.upper_bound(123'456'789'013), 1);
  hidden.clear();
  for (const auto& [number, share] : shares) EXPECT_EQ(hidden.upper_bound(number), 1);
}

// Number of occluded sources that a keyframe finds, of `count` with this priority without
// occlusion.
std::size_t found_in_turn(OcclusionUpperBounds& hidden, std::size_t count, float as_if_free) {
  hidden.begin_keyframe(false);
  std::size_t found = 0, in_full = 0;
  for (std::uint64_t number = 0; number < count; ++number) {
    found += hidden.upper_bound(number) * as_if_free >= 1;
    in_full += hidden.is_retested(number);
  }
  hidden.adapt_phases(in_full, 4000);
  return found;
}

TEST(OcclusionUpperBounds, LimitTheNumberOfRetestsPerKeyframeWhenAllAreOccluded) {
  constexpr std::size_t kCount = 100'000;
  OcclusionUpperBounds hidden;
  for (std::uint64_t number = 0; number < kCount; ++number)
    hidden.set(number, OcclusionUpperBounds::kOccluded);
  for (int keyframe = 0; keyframe < 10; ++keyframe) found_in_turn(hidden, kCount, 7);
  EXPECT_EQ(hidden.phases(), 32u);
  EXPECT_LE(found_in_turn(hidden, kCount, 7), 4000u);
  EXPECT_EQ(found_in_turn(hidden, kCount, 1000), kCount / 4)
      << "the loudest sources keep their interval";
  std::vector<int> asked(kCount);
  for (int keyframe = 0; keyframe < 32; ++keyframe) {
    hidden.begin_keyframe(false);
    for (std::uint64_t number = 0; number < kCount; ++number)
      asked[number] += hidden.upper_bound(number) == 1;
  }
  EXPECT_EQ(std::count(asked.begin(), asked.end(), 1), std::ptrdiff_t{kCount}) << "all, in turn";
  for (int keyframe = 0; keyframe < 10; ++keyframe) found_in_turn(hidden, 1000, 7);
  EXPECT_EQ(hidden.phases(), OcclusionUpperBounds::kPhases)
      << "few occluded sources keep the shortest interval";
  EXPECT_EQ(found_in_turn(hidden, 1000, 7), 250u);
}

// Sources of the page that begins with this number, each with an upper bound.
std::vector<ShortlistBlock> some_sources(std::uint32_t count, std::uint32_t seed) {
  std::vector<ShortlistBlock> blocks;
  std::uint32_t index = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const RandomBits bits = philox(seed, {i, 0, 0, 0});
    const std::size_t at = i % kCullBlock;
    if (at == 0) blocks.emplace_back().upper_bound.fill(-1);
    ShortlistBlock& block = blocks.back();
    index += 1 + bits[0] % 3;
    block.source[at] = index;
    block.upper_bound[at] = static_cast<float>(std::pow(2.0, 16 * unit(bits[1])));
  }
  return blocks;
}

TEST(OcclusionUpperBounds, AreTheSameInTheShortlistKernel) {
  std::size_t found = 0, left_out = 0;
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    const std::uint64_t first = philox(seed, {0, 1, 0, 0})[0] % 3000;
    const std::vector<ShortlistBlock> blocks = some_sources(300, seed);
    OcclusionUpperBounds hidden;
    for (std::uint32_t i = 0; i < 1000; ++i) {
      const RandomBits bits = philox(seed, {i, 2, 0, 0});
      hidden.set(first + bits[0] % 1000, static_cast<std::uint8_t>(bits[1] % 16));
    }
    for (std::uint32_t keyframe = 0; keyframe < seed % 40; ++keyframe) {
      hidden.begin_keyframe(keyframe % 11 == 10);
      hidden.adapt_phases(seed % 3 == 0 ? 0 : 100, 10);
    }
    const OcclusionUpperBounds::Window window = hidden.window(first);
    AudibleEntries loud;
    loud.clear(kCullBlock * blocks.size());
    find_audible(blocks, 1, LoudnessTable(), window, loud);
    const std::size_t end = loud.count;
    std::size_t next = 0;
    for (std::uint32_t e = 0; e < 300; ++e) {
      const ShortlistBlock& block = blocks[e / 16];
      const std::uint32_t index = block.source[e % 16];
      const float left = hidden.upper_bound(first + index);
      if (block.upper_bound[e % 16] * left < 1) {
        ++left_out;
        continue;
      }
      ASSERT_LT(next, end);
      ASSERT_EQ(loud.entry[next], e) << seed;
      const float known = loud.known[next++];
      ASSERT_EQ(window.upper_bound(index, known), left) << seed;
      ASSERT_EQ(window.words == nullptr ? 1 : hidden.upper_bound(first + index, known), left);
      ++found;
    }
    ASSERT_EQ(next, end);
  }
  EXPECT_GT(found, 10'000u);
  EXPECT_GT(left_out, 5000u);
}

}  // namespace
}  // namespace clamor
