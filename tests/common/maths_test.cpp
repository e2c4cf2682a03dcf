#include "common/maths.h"

#include <algorithm>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace clamor {
namespace {

// The C library's double functions are the reference; their errors are 1e8 times smaller.

TEST(Maths, FloatLogarithmsAreWithinTheErrorStated) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> exponents(-125, 125), ones(0.5f, 2);
  for (int i = 0; i < 200000; ++i) {
    const float wide = std::exp2(exponents(random)), near = ones(random);
    for (const float x : {wide, near}) {
      const double exact = std::log2(static_cast<double>(x));
      ASSERT_LE(std::abs(log2_of(x) - exact), 2e-7 * std::max(1.0, std::abs(exact))) << x;
      if (std::abs(exact) < 0.1) {
        ASSERT_LE(std::abs(log2_of(x) - exact), 3e-7 * std::abs(exact)) << x;
      }
    }
  }
  EXPECT_EQ(log2_of(1.0f), 0.0f);
  EXPECT_EQ(log2_of(0.25f), -2.0f);
}

TEST(Maths, FloatPowersOfTwoAreWithinTheErrorStated) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> exponents(-126, 126);
  for (int i = 0; i < 400000; ++i) {
    const float x = exponents(random);
    ASSERT_NEAR(exp2_of(x) / std::exp2(static_cast<double>(x)), 1, 2e-7) << x;
  }
  EXPECT_EQ(exp2_of(0.0f), 1.0f);
  EXPECT_EQ(exp2_of(-1000.0f), 0x1p-126f);
  EXPECT_EQ(exp2_of(1000.0f), 0x1p126f);
}

TEST(Maths, FloatSinesAreWithinTheErrorStated) {
  for (int i = 0; i <= 1'000'000; ++i) {
    const float u = static_cast<float>(i) / 1'000'000;
    const double turn = 2 * std::numbers::pi * static_cast<double>(u);
    const SinCos found = sin_cos_of_turn(u);
    ASSERT_NEAR(found.sin, std::sin(turn), 1.5e-7) << u;
    ASSERT_NEAR(found.cos, std::cos(turn), 1.5e-7) << u;
  }
}

TEST(Maths, DoubleFunctionsAreWithinTheErrorStated) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 200000; ++i) {
    const double x = std::exp2(unit(random) * 200 - 100);
    ASSERT_NEAR(log2_of(x), std::log2(x), 1e-15 * std::max(1.0, std::abs(std::log2(x)))) << x;
    const double e = unit(random) * 2000 - 1000;
    ASSERT_NEAR(exp2_of(e) / std::exp2(e), 1, 1e-15) << e;
    const double base = unit(random), p = unit(random) * 50;
    ASSERT_NEAR(power(base, p) / std::pow(base, p), 1,
                1e-14 * std::max(1.0, std::abs(p * std::log2(base)) / 10))
        << base << " to the " << p;
    const double angle = unit(random) * 200 - 100;
    ASSERT_NEAR(sin_of(angle), std::sin(angle), 1e-15) << angle;
    ASSERT_NEAR(cos_of(angle), std::cos(angle), 1e-15) << angle;
    const double c = unit(random) * 2 - 1;
    ASSERT_NEAR(acos_of(c), std::acos(c), 2e-15) << c;
    ASSERT_NEAR(hypotenuse(base, angle), std::hypot(base, angle), 1e-15 * (1 + std::abs(angle)));
    ASSERT_NEAR(arsinh(angle), std::asinh(angle), 4e-15) << angle;
    ASSERT_NEAR(arcosh(1 + base), std::acosh(1 + base), 1e-15) << base;
    const double close = 1 - unit(random) * 1e-9;
    ASSERT_NEAR(acos_of(close) / std::acos(close), 1, 1e-15) << close;
  }
  EXPECT_EQ(acos_of(1), 0);
  EXPECT_EQ(acos_of(-1), std::numbers::pi);
  EXPECT_EQ(power(0, 2), 0);
  EXPECT_EQ(power(0, 0), 1);
}

// Checksums of exact bits detect CPUs, compilers and libraries that round differently.
TEST(Maths, HaveTheseExactBits) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto add = [&hash](auto value) {
    if constexpr (sizeof value == 4)
      hash = (hash ^ std::bit_cast<std::uint32_t>(value)) * 0x100000001b3u;
    else
      hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001b3u;
  };
  for (int i = 1; i < 10000; ++i) {
    const float x = static_cast<float>(i) / 1237, u = static_cast<float>(i) / 10000;
    add(log2_of(x));
    add(exp2_of(x - 4));
    add(sin_cos_of_turn(u).sin);
    add(sin_cos_of_turn(u).cos);
    const double y = static_cast<double>(i) / 1237;
    add(log2_of(y));
    add(exp2_of(y - 4));
    add(power(y, 2.5));
    add(sin_of(y));
    add(cos_of(y));
    add(acos_of(static_cast<double>(i) / 5000 - 1));
  }
  EXPECT_EQ(hash, 2777487785634156712u);
}

}  // namespace
}  // namespace clamor
