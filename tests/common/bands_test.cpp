#include "common/bands.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clamor {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatEq;

TEST(Bands, AreInterpolatedLinearlyInFrequency) {
  const std::vector<double> hz = {125, 500, 4000}, values = {0.1, 0.4, 1.1};
  // 250 Hz lies a third of the way from 125 to 500; 1000 and 2000 Hz lie 1/7 and 3/7 from 500 to
  // 4000 Hz. Values are constant beyond the ends.
  EXPECT_THAT(bands_from_points(hz, values),
              ElementsAre(FloatEq(0.1f), FloatEq(0.1f), FloatEq(0.2f), FloatEq(0.4f), FloatEq(0.5f),
                          FloatEq(0.7f), FloatEq(1.1f), FloatEq(1.1f)));
}

TEST(Bands, AreExactAtGivenFrequencies) {
  const std::vector<double> values = {1, 2, 3, 4, 5, 6, 7, 8};
  EXPECT_THAT(bands_from_points(kBandCentres_hz, values), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
}

TEST(Bands, AreEqualForASingleValue) {
  const std::vector<double> hz = {1000}, values = {0.25};
  EXPECT_EQ(bands_from_points(hz, values), same_in_all_bands(0.25f));
}

TEST(Bands, AreInterpolatedFromPointsOutsideTheirRange) {
  const std::vector<double> hz = {31.5, 16000}, values = {0, 15968.5};
  const Bands bands = bands_from_points(hz, values);
  for (std::size_t b = 0; b < kBandCount; ++b)
    EXPECT_NEAR(bands[b], kBandCentres_hz[b] - 31.5, 1e-3);
}

}  // namespace
}  // namespace clamor
