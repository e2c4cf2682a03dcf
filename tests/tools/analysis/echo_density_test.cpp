#include "tools/analysis/echo_density.h"

#include <cmath>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "tests/tools/analysis/test_sounds.h"

namespace clamor {
namespace {

constexpr double kGaussianShare = 0.31731;  // beyond one standard deviation

std::vector<double> in_double(const std::vector<float>& samples) {
  return {samples.begin(), samples.end()};
}

double mean_density(const std::vector<double>& response) {
  const auto densities = echo_density(response, 0);
  return std::accumulate(densities.begin(), densities.end(), 0.0) /
         static_cast<double>(densities.size());
}

TEST(EchoDensity, OfGaussianNoiseIsOne) {
  EXPECT_NEAR(mean_density(in_double(testing::noise(1, 0.1, 4))), 1, 0.01);
}

TEST(EchoDensity, OfKnownDistributionsIsTheirShareBeyondOneStandardDeviation) {
  // A sine exceeds its effective value half of the time, and uniform noise for 1 - 1 / sqrt 3 of
  // it.
  EXPECT_NEAR(mean_density(in_double(testing::sine(1234.5, 3, 1))), 0.5 / kGaussianShare, 0.02);
  std::vector<double> uniform(96000);
  for (std::size_t i = 0; i < uniform.size(); ++i)
    uniform[i] = unit(philox(2, {static_cast<std::uint32_t>(i), 0, 0, 0})[0]) - 0.5;
  EXPECT_NEAR(mean_density(uniform), (1 - 1 / std::numbers::sqrt3) / kGaussianShare, 0.01);
}

TEST(EchoDensity, OfSparseEchoesIsTheirShareOfTheSamples) {
  // If a share p of the samples is +-1 and the rest 0, sigma is sqrt p and all echoes exceed it.
  for (const double p : {0.001, 0.01, 0.1}) {
    std::vector<double> response(480000);
    for (std::size_t i = 0; i < response.size(); ++i) {
      const RandomBits bits = philox(3, {static_cast<std::uint32_t>(i), 0, 0, 0});
      if (unit(bits[0]) < p) response[i] = bits[1] % 2 == 0 ? 1 : -1;
    }
    EXPECT_NEAR(mean_density(response), p / kGaussianShare, 0.05 * p / kGaussianShare) << p;
  }
}

TEST(EchoDensity, RisesFromEchoesToATail) {
  std::vector<double> response(48000);
  const auto tail = testing::noise(4, 0.1, 1);
  for (std::size_t i = 0; i < 24000; i += 480) response[i] = 1;
  for (std::size_t i = 24000; i < 48000; ++i) response[i] = tail[i];
  const auto densities = echo_density(response, 0);
  ASSERT_EQ(densities.size(), 200u);  // one every 5 ms
  EXPECT_LT(densities[50], 0.02);
  EXPECT_NEAR(densities[150], 1, 0.25);  // 20 ms are few samples
}

TEST(EchoDensity, OfSilenceIsZeroAndOfNothingIsEmpty) {
  for (const double density : echo_density(std::vector<double>(4800), 0)) EXPECT_EQ(density, 0);
  EXPECT_TRUE(echo_density({}, 0).empty());
  EXPECT_TRUE(echo_density(std::vector<double>(100), 100).empty());
  EXPECT_EQ(echo_density(std::vector<double>(1, 1.0), 0).size(), 1u);
}

}  // namespace
}  // namespace clamor
