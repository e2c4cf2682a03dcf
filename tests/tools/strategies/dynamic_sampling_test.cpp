// dynamic_sampling_test.cpp: inclusion probabilities, draws and exchanges (sections 3.3 and 3.4 of
// the paper).
#include "tools/strategies/dynamic_sampling.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include <gtest/gtest.h>

namespace clamor {
namespace {

using Rule = DynamicSample::Rule;

std::vector<DynamicSample::Candidate> candidates_of(const std::vector<double>& weights) {
  std::vector<DynamicSample::Candidate> candidates;
  for (std::size_t i = 0; i < weights.size(); ++i) candidates.push_back({10 + 3 * i, weights[i]});
  return candidates;
}

std::set<std::uint32_t> next(DynamicSample& sample,
                             const std::vector<DynamicSample::Candidate>& candidates) {
  std::set<std::uint32_t> chosen;
  for (const auto& one : sample.next(candidates)) chosen.insert(one.candidate);
  return chosen;
}

std::size_t newcomers(const std::set<std::uint32_t>& before, const std::set<std::uint32_t>& now) {
  return static_cast<std::size_t>(
      std::count_if(now.begin(), now.end(), [&](auto c) { return !before.contains(c); }));
}

TEST(DynamicSampling, KeepsASampleThatIsDrawnOnce) {
  DynamicSample sample(Rule::kOnce, 50, {});
  auto candidates = candidates_of(std::vector<double>(500, 1));
  const auto first = next(sample, candidates);
  for (DynamicSample::Candidate& candidate : candidates)
    candidate.weight = 1 + candidate.number % 5;
  EXPECT_EQ(next(sample, candidates), first);
}

TEST(DynamicSampling, RedrawsTheWholeSampleAtItsInterval) {
  StrategyTuning tuning;
  tuning.redraw_s = 0.2;  // 10 keyframes
  DynamicSample sample(Rule::kFull, 50, tuning);
  const auto candidates = candidates_of(std::vector<double>(5000, 1));
  auto last = next(sample, candidates);
  for (int keyframe = 1; keyframe < 40; ++keyframe) {
    const auto now = next(sample, candidates);
    if (keyframe % 10 == 0)
      EXPECT_GT(newcomers(last, now), 40u);
    else
      EXPECT_EQ(now, last);
    last = now;
  }
}

TEST(DynamicSampling, ByStochasticDiffusionExchangesTheRequestedShare) {
  DynamicSample sample(Rule::kStochastic, 500, {});  // q = 0.2
  const auto candidates = candidates_of(std::vector<double>(5000, 1));
  auto last = next(sample, candidates);
  std::size_t exchanged = 0;
  for (int keyframe = 1; keyframe <= 500; ++keyframe) {  // 10 s
    const auto now = next(sample, candidates);
    ASSERT_EQ(now.size(), 500u);
    exchanged += newcomers(last, now);
    last = now;
  }
  // The expected number is 0.2 x 500 x 10; one source in 500 leaves in the keyframe in which it
  // entered.
  EXPECT_NEAR(static_cast<double>(exchanged), 1000, 10);
}

// Inclusion probabilities if each set of k is drawn in proportion to the product of its odds: by
// the sums of products over all sets, e(k, without i) and e(k, all).
std::vector<double> by_odds(const std::vector<double>& probabilities, std::size_t k) {
  const auto products = [&](std::size_t left_out) {
    std::vector<double> e(k + 1, 0);
    e[0] = 1;
    for (std::size_t i = 0; i < probabilities.size(); ++i)
      if (i != left_out)
        for (std::size_t j = k; j > 0; --j)
          e[j] += e[j - 1] * probabilities[i] / (1 - probabilities[i]);
    return e[k];
  };
  std::vector<double> result;
  for (std::size_t i = 0; i < probabilities.size(); ++i)
    result.push_back(1 - products(i) / products(probabilities.size()));
  return result;
}

TEST(DynamicSampling, ByStochasticDiffusionKeepsTheProbabilityOfEachSource) {
  std::vector<double> weights;
  for (int i = 0; i < 40; ++i) weights.push_back(1 + i % 8);
  const auto probabilities = inclusion_probabilities(weights, 10);
  StrategyTuning tuning;
  tuning.exchange_per_s = 5;  // one of ten per keyframe
  DynamicSample sample(Rule::kStochastic, 10, tuning);
  const auto candidates = candidates_of(weights);
  std::vector<double> count(weights.size());
  constexpr int kKeyframes = 100000;
  for (int keyframe = 0; keyframe < kKeyframes; ++keyframe)
    for (const std::uint32_t c : next(sample, candidates)) ++count[c];
  const auto expected = by_odds(probabilities, 10);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    // A source stays for about ten keyframes, so twenty count as one draw: the deviation is 0.0061.
    EXPECT_NEAR(count[i] / kKeyframes, expected[i], 0.025);
    // The difference is the theoretical term of order 1 / k.
    EXPECT_NEAR(expected[i] / probabilities[i], 1, 0.1);
  }
}

TEST(DynamicSampling, ByAdaptiveDiffusionKeepsSourcesThatChangeLessThanEpsilon) {
  DynamicSample sample(Rule::kAdaptive, 100, {});  // 1.25
  auto candidates = candidates_of(std::vector<double>(1000, 1));
  const auto first = next(sample, candidates);
  for (DynamicSample::Candidate& candidate : candidates)
    candidate.weight = candidate.number % 2 ? 1.24 : 0.81;
  EXPECT_EQ(next(sample, candidates), first);
}

TEST(DynamicSampling, ByAdaptiveDiffusionExchangesSourcesThatFellByEpsilon) {
  DynamicSample sample(Rule::kAdaptive, 100, {});
  auto candidates = candidates_of(std::vector<double>(1000, 1));
  const auto first = next(sample, candidates);
  std::size_t fallen = 0;
  for (const std::uint32_t c : first)
    if (c % 2 == 0) {
      candidates[c].weight = 1e-9;  // too low to be drawn again
      ++fallen;
    }
  const auto now = next(sample, candidates);
  EXPECT_EQ(now.size(), 100u);
  EXPECT_EQ(newcomers(first, now), fallen);
  for (const std::uint32_t c : first) EXPECT_EQ(now.contains(c), c % 2 != 0);
  EXPECT_EQ(next(sample, candidates), now) << "a second draw must change nothing";
}

TEST(DynamicSampling, ByAdaptiveDiffusionExchangesOneForEachSourceThatGrewByEpsilon) {
  DynamicSample sample(Rule::kAdaptive, 1000, {});
  auto candidates = candidates_of(std::vector<double>(100000, 1));
  const auto first = next(sample, candidates);
  int grown = 0;
  for (const std::uint32_t c : first)
    if (grown < 30) {
      candidates[c].weight = 2;
      ++grown;
    }
  const auto now = next(sample, candidates);
  EXPECT_EQ(now.size(), 1000u);
  // One draw in a hundred hits a source that is already leaving or returns at once.
  EXPECT_NEAR(static_cast<double>(newcomers(first, now)), 30, 1);
  EXPECT_EQ(next(sample, candidates), now) << "a second draw must change nothing";
}

TEST(DynamicSampling, DropsSourcesThatAreNoCandidates) {
  DynamicSample sample(Rule::kAdaptive, 20, {});
  auto candidates = candidates_of(std::vector<double>(100, 1));
  next(sample, candidates);
  candidates.erase(candidates.begin(), candidates.begin() + 50);
  const auto now = next(sample, candidates);
  EXPECT_EQ(now.size(), 20u);
  EXPECT_LT(*now.rbegin(), 50u);
}

TEST(DynamicSampling, DependsOnlyOnItsSeed) {
  const auto candidates = candidates_of(std::vector<double>(1000, 1));
  StrategyTuning other;
  other.seed = 2;
  DynamicSample a(Rule::kStochastic, 50, {}), b(Rule::kStochastic, 50, {}),
      c(Rule::kStochastic, 50, other);
  for (int keyframe = 0; keyframe < 50; ++keyframe) {
    const auto of_a = next(a, candidates);
    EXPECT_EQ(of_a, next(b, candidates));
    EXPECT_NE(of_a, next(c, candidates));
  }
}

}  // namespace
}  // namespace clamor
