#include "common/vec.h"

#include <limits>

#include <gtest/gtest.h>

#include "common/random.h"

namespace clamor {
namespace {

void expect_right_handed_basis(const Vec3& n) {
  const Basis basis = basis_around(n);
  EXPECT_NEAR(length(basis.tangent), 1, 1e-14);
  EXPECT_NEAR(length(basis.bitangent), 1, 1e-14);
  EXPECT_NEAR(dot(basis.tangent, basis.bitangent), 0, 1e-14);
  EXPECT_NEAR(dot(basis.tangent, n), 0, 1e-14);
  EXPECT_NEAR(length(cross(basis.tangent, basis.bitangent) - n), 0, 1e-14);
}

TEST(Basis, IsOrthonormalAndRightHandedAroundAnyDirection) {
  for (std::uint32_t i = 0; i < 10000; ++i) {
    const RandomBits bits = philox(5, {i, 0, 0, 0});
    const Vec3 v(unit(bits[0]) - 0.5, unit(bits[1]) - 0.5, unit(bits[2]) - 0.5);
    if (length(v) > 0.1) expect_right_handed_basis(normalize(v));
  }
}

TEST(Basis, IsOrthonormalWhereItsFormulaChangesSign) {
  for (const double z : {1.0, -1.0}) {
    expect_right_handed_basis({0, 0, z});
    for (const double tilt : {1e-9, 1e-5, -1e-5, 1e-2})
      expect_right_handed_basis(normalize(Vec3(tilt, -tilt, z)));
  }
  for (const double z : {0.0, -0.0, 1e-300, -1e-300}) {
    expect_right_handed_basis(Vec3(1, 0, z));
    expect_right_handed_basis(Vec3(0, -1, z));
  }
}

TEST(Vec, IsFiniteOnlyIfEveryCoordinateIs) {
  EXPECT_TRUE(is_finite({1, -2, 3}));
  EXPECT_FALSE(is_finite({1, std::numeric_limits<double>::quiet_NaN(), 3}));
  EXPECT_FALSE(is_finite({1, 2, -std::numeric_limits<double>::infinity()}));
}

}  // namespace
}  // namespace clamor
