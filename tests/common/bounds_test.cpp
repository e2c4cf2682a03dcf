#include "common/bounds.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace clamor {
namespace {

TEST(Bounds, EncloseThePlacesOfItemsAndNothingElse) {
  struct Item {
    Vec3 place_m;
  };
  const std::vector<Item> items = {{{1, -2, 3}}, {{-1, 5, 3}}};
  const Bounds bounds = bounds_of(items, &Item::place_m);
  EXPECT_EQ(bounds.low_m, Vec3(-1, -2, 3));
  EXPECT_EQ(bounds.high_m, Vec3(1, 5, 3));
  EXPECT_DOUBLE_EQ(bounds.diagonal_m(), std::sqrt(53.0));
  EXPECT_FALSE(bounds.is_empty());
}

TEST(Bounds, OfNothingAreEmptyAndTakeTheirFirstPointAsItIs) {
  Boundsf bounds = bounds_of(std::vector<Vec3f>());
  EXPECT_TRUE(bounds.is_empty());
  bounds.add(Vec3f(-7, 0, 2e6f));
  EXPECT_EQ(bounds.low_m, Vec3f(-7, 0, 2e6f));
  EXPECT_EQ(bounds.high_m, bounds.low_m);
}

}  // namespace
}  // namespace clamor
