#include "formats/level/level_origin.h"

#include <limits>

#include <gtest/gtest.h>

namespace clamor {
namespace {

TEST(LevelOrigin, IsThatOfTheWorldNearIt) {
  EXPECT_EQ(level_origin_m({0, 0, 0}), Vec3(0));
  EXPECT_EQ(level_origin_m({300, -100, 380}), Vec3(0));
  EXPECT_EQ(level_origin_m({1e300, 0, 0}), Vec3(0));
}

TEST(LevelOrigin, MovesWithTheLevelByWholeHundredsOfMetres) {
  EXPECT_EQ(level_origin_m({1012, 4.5, -697}), Vec3(1000, 0, -700));
  EXPECT_EQ(level_origin_m({1012 + 559'000, 4.5, -697 - 2'600'000}), Vec3(560'000, 0, -2'600'700));
}

TEST(LevelOrigin, IsSubtractedFromPlacesInTheWorldAndNothingElse) {
  const Vec3 origin_m(560'000, 0, -2'600'700);
  EXPECT_EQ(in_level({560'001, 1.5, -2'600'703}, origin_m), Vec3(1, 1.5, -3));
  // A place on the other side of the earth is as far as numbers in a level go.
  EXPECT_EQ(in_level({-2e7, 0, -2'600'700}, origin_m), Vec3(-1e6, 0, 0));
  EXPECT_EQ(in_level({1e30, 0, 0}, origin_m), Vec3(1e30, 0, 0));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(is_finite(in_level({nan, 0, 0}, origin_m)));
}

}  // namespace
}  // namespace clamor
