#include "tools/analysis/null_distribution.h"

#include <array>
#include <atomic>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tools/analysis/test_sounds.h"
#include "tools/analysis/random_texture.h"

namespace clamor {
namespace {

// A difference of a given size in loudness, in JNDs.
std::vector<Difference> loudness_difference(double size) {
  return {{&kMeasures[0], {{.a = 0, .b = size, .difference = size, .jnd = 1}}}};
}

TEST(NullDistribution, TakesThePercentileThatAnExactRenderingExceedsOneTimeInTwenty) {
  // Sizes 0 to n-1 in any order; the result is number 0.95 (n + 1).
  for (const auto& [count, expected] : {std::pair(19, 18), {39, 37}, {99, 94}, {100, 95}}) {
    std::vector<std::vector<Difference>> rolls;
    for (int i = 0; i < count; ++i) rolls.push_back(loudness_difference(i * 7 % count));
    EXPECT_EQ(NullDistribution(rolls).size_95(Measure::kIntegratedLoudness), expected) << count;
  }
}

TEST(NullDistribution, RequestsEveryDrawOnceInAnyOrder) {
  std::vector<std::atomic<int>> asked(100);
  const auto null = null_distribution(100, [&](std::uint32_t roll) {
    ++asked[roll];
    return loudness_difference(-static_cast<double>(roll));  // only its magnitude counts
  });
  for (const auto& times_asked : asked) EXPECT_EQ(times_asked, 1);
  EXPECT_EQ(null.size_95(Measure::kIntegratedLoudness), 95);
}

TEST(NullDistribution, ForgivesChanceButNoLargerAudibleDifference) {
  const Difference difference = loudness_difference(2).front();
  EXPECT_TRUE(difference.audible());
  EXPECT_TRUE(difference.audible(1.9));
  EXPECT_FALSE(difference.audible(2.1));
  EXPECT_FALSE(loudness_difference(0.9).front().audible(0.1));  // inaudible
}

}  // namespace
}  // namespace clamor
