#include "common/directivity.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace clamor {
namespace {

TEST(Directivity, KeepsTheLevelOnTheAxis) {
  for (const double p : {0.0, 0.5, 1.0, 20.0}) EXPECT_EQ(emission(p, 1), 1);
}

TEST(Directivity, IsACardioidInPowerAtExponentOne) {
  EXPECT_DOUBLE_EQ(emission(1, 0), 0.5);
  EXPECT_DOUBLE_EQ(emission(1, -1), 0);
  EXPECT_DOUBLE_EQ(emission(0, -1), 1);
}

TEST(Directivity, RadiatesThePowerThatIntegrationGives) {
  constexpr int kSteps = 100000;
  for (const double p : {0.0, 0.3, 1.0, 7.0, 100.0}) {
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) sum += emission(p, -1 + 2 * (i + 0.5) / kSteps);
    const double power = 2 * std::numbers::pi * sum * 2 / kSteps;
    // The midpoint rule is that accurate even for p = 0.3, which has an infinite slope at cos a =
    // -1.
    EXPECT_NEAR(power / emission_power(p), 1, 1e-5) << "p = " << p;
  }
}

TEST(Directivity, DrawsDirectionsAsDenselyAsItRadiates) {
  // With regularly spaced u, each of 50 slices in cos a gets its share of the power within one draw
  // at each end.
  constexpr int kDraws = 100000, kSlices = 50;
  for (const double p : {0.0, 0.3, 1.0, 7.0, 100.0}) {
    std::vector<int> drawn(kSlices);
    for (int i = 0; i < kDraws; ++i) {
      const double cos_a = draw_emission_cos(p, (i + 0.5) / kDraws);
      ASSERT_GE(cos_a, -1);
      ASSERT_LE(cos_a, 1);
      ++drawn[std::min(kSlices - 1, static_cast<int>((cos_a + 1) / 2 * kSlices))];
    }
    for (int s = 0; s < kSlices; ++s) {
      double share = 0;  // by integrating the law
      constexpr int kSteps = 2000;
      for (int i = 0; i < kSteps; ++i) {
        const double cos_a = -1 + 2 * (s + (i + 0.5) / kSteps) / kSlices;
        share += emission(p, cos_a) * 2 * std::numbers::pi * 2 / kSlices / kSteps;
      }
      EXPECT_NEAR(drawn[s], kDraws * share / emission_power(p), 2)
          << "p = " << p << ", slice " << s;
    }
  }
}

}  // namespace
}  // namespace clamor
