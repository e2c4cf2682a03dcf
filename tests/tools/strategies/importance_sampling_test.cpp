// importance_sampling_test.cpp: inclusion probabilities and draws (section 3.3 of the paper).
#include "tools/strategies/importance_sampling.h"

#include <cmath>
#include <cstdint>
#include <numeric>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"

namespace clamor {
namespace {

const std::vector<double> kWeights = {0.1, 3, 0.5, 2, 1, 1, 0, 0.2, 4, 0.7, 1.5, 2.5};

TEST(ImportanceSampling, GivesProportionalProbabilitiesThatSumToTheSampleSize) {
  const double sum = std::accumulate(kWeights.begin(), kWeights.end(), 0.0);
  const auto probabilities = inclusion_probabilities(kWeights, 3);
  for (std::size_t i = 0; i < kWeights.size(); ++i)
    EXPECT_NEAR(probabilities[i], 3 * kWeights[i] / sum, 1e-12);
}

TEST(ImportanceSampling, MakesSourcesCertainWhoseProbabilityWouldExceedOne) {
  const std::vector<double> weights = {10, 1, 1, 1, 1, 5};
  // 3 x 10 / 19 > 1, then 2 x 5 / 9 > 1, then 1 x 1 / 4.
  EXPECT_EQ(inclusion_probabilities(weights, 3),
            (std::vector<double>{1, 0.25, 0.25, 0.25, 0.25, 1}));
}

TEST(ImportanceSampling, TakesAllAudibleSourcesWhenThereIsRoom) {
  const auto probabilities = inclusion_probabilities(kWeights, 50);
  for (std::size_t i = 0; i < kWeights.size(); ++i)
    EXPECT_EQ(probabilities[i], kWeights[i] > 0 ? 1 : 0);
  Draws draws(1, 0);
  EXPECT_EQ(choose_without_replacement(probabilities, draws).size(), 11u);
}

// A sample of one is a single draw.
TEST(ImportanceSampling, DrawsOneSourceWithItsProbability) {
  const auto probabilities = inclusion_probabilities(kWeights, 1);
  std::vector<double> count(kWeights.size());
  constexpr int kThrows = 20000;
  for (int t = 0; t < kThrows; ++t) {
    Draws draws(5, static_cast<std::uint64_t>(t));
    const auto chosen = choose_without_replacement(probabilities, draws);
    ASSERT_EQ(chosen.size(), 1u);
    ++count[chosen[0]];
  }
  double chi2 = 0;
  for (std::size_t i = 0; i < count.size(); ++i) {
    const double expected = probabilities[i] * kThrows;
    if (expected == 0)
      EXPECT_EQ(count[i], 0);
    else
      chi2 += (count[i] - expected) * (count[i] - expected) / expected;
  }
  // There are 11 sources and 10 degrees of freedom: beyond 29.6 one time in 1000.
  EXPECT_LT(chi2, 29.6);
}

TEST(ImportanceSampling, DrawsTheRequestedNumberWithoutReplacementWithTheRightProbabilities) {
  for (const std::size_t k : {2u, 5u, 8u}) {
    const auto probabilities = inclusion_probabilities(kWeights, k);
    std::vector<double> count(kWeights.size());
    constexpr int kDrawings = 20000;
    for (int d = 0; d < kDrawings; ++d) {
      Draws draws(k, static_cast<std::uint64_t>(d));
      const auto chosen = choose_without_replacement(probabilities, draws);
      ASSERT_EQ(std::set<std::uint32_t>(chosen.begin(), chosen.end()).size(), k);
      for (const std::uint32_t i : chosen) ++count[i];
    }
    for (std::size_t i = 0; i < count.size(); ++i) {
      const double p = probabilities[i];
      // There are 33 binomials: beyond 4 deviations one time in 500.
      EXPECT_NEAR(count[i] / kDrawings, p, 4 * std::sqrt(p * (1 - p) / kDrawings) + 1e-12)
          << "source " << i << " of k = " << k;
    }
  }
}

TEST(ImportanceSampling, GivesEachHalfOfTheListItsShareRoundedUpOrDown) {
  std::vector<double> weights;
  for (int i = 0; i < 1000; ++i) weights.push_back(1 + i % 17);
  const auto probabilities = inclusion_probabilities(weights, 100);
  double due = 0;
  for (std::size_t i = 0; i < 512; ++i) due += probabilities[i];
  for (std::uint64_t drawing = 0; drawing < 50; ++drawing) {
    Draws draws(1, drawing);
    const auto chosen = choose_without_replacement(probabilities, draws);
    EXPECT_EQ(chosen.size(), 100u);
    const auto left = std::count_if(chosen.begin(), chosen.end(), [](auto i) { return i < 512; });
    EXPECT_NEAR(static_cast<double>(left), due, 1);
  }
}

}  // namespace
}  // namespace clamor
