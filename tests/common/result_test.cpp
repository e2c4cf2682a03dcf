#include "common/result.h"

#include <memory>

#include <gtest/gtest.h>

namespace clamor {
namespace {

Result<int> whole_number(bool good) {
  if (good) return 42;
  return Error("the number is broken");
}

TEST(Result, HoldsAValueOrAnError) {
  const Result<int> good = whole_number(true), bad = whole_number(false);
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(*good, 42);
  ASSERT_FALSE(bad.ok());
  EXPECT_FALSE(bad);
  EXPECT_EQ(bad.error().message, "the number is broken");
}

TEST(Result, MovesItsValueWithoutACopy) {
  Result<std::unique_ptr<int>> result(std::make_unique<int>(7));
  ASSERT_TRUE(result);
  const std::unique_ptr<int> value = *std::move(result);
  EXPECT_EQ(*value, 7);
}

TEST(Result, OfVoidIsOkUnlessItHoldsAnError) {
  EXPECT_TRUE(Result<void>().ok());
  const Result<void> bad = Error("no");
  ASSERT_FALSE(bad.ok());
  EXPECT_EQ(bad.error().message, "no");
}

TEST(Error, IsPrefixedWithItsContext) {
  EXPECT_EQ(Error("no triangles").in("mesh 3").in("level.gltf").message,
            "level.gltf: mesh 3: no triangles");
  EXPECT_EQ(in_quotes("wood"), "'wood'");
}

}  // namespace
}  // namespace clamor
