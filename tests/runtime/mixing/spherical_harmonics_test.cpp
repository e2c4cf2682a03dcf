#include "runtime/mixing/spherical_harmonics.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/runtime/random_directions.h"

namespace clamor {
namespace {

using testing::random_directions;

// Associated Legendre function P_l^m(s), m >= 0, without the Condon-Shortley phase, by recursion.
double legendre(int l, int m, double s) {
  double diagonal = 1;
  for (int i = 1; i <= m; ++i) diagonal *= (2 * i - 1) * std::sqrt(1 - s * s);
  double before = 0, now = diagonal;
  for (int i = m + 1; i <= l; ++i) {
    const double next = ((2 * i - 1) * s * now - (i + m - 1) * before) / (i - m);
    before = now;
    now = next;
  }
  return now;
}

TEST(SphericalHarmonics, EqualTheRecursionInAmbixOrder) {
  for (const Vec3f& from : random_directions(1000)) {
    const auto harmonics = spherical_harmonics(from);
    // The recursion holds on the unit sphere only, and near the poles a float is not on it.
    const Vec3 on_sphere = normalize(Vec3(from));
    const double azimuth = std::atan2(on_sphere.y, on_sphere.x);
    for (int l = 0; l <= kAmbisonicOrder; ++l)
      for (int m = -l; m <= l; ++m) {
        const int k = std::abs(m);
        const double n =
            std::sqrt((m == 0 ? 1 : 2) * std::tgamma(l - k + 1.0) / std::tgamma(l + k + 1.0));
        const double expected = n * legendre(l, k, on_sphere.z) *
                                (m >= 0 ? std::cos(k * azimuth) : std::sin(k * azimuth));
        EXPECT_NEAR(harmonics[static_cast<std::size_t>(l * (l + 1) + m)], expected, 3e-6)
            << l << ' ' << m;
      }
  }
}

TEST(SphericalHarmonics, HaveSquaresThatSumToOneInEachOrder) {
  for (const Vec3f& from : random_directions(1000)) {
    const auto harmonics = spherical_harmonics(from);
    for (std::size_t l = 0; l <= kAmbisonicOrder; ++l) {
      double sum = 0;
      for (std::size_t c = l * l; c < (l + 1) * (l + 1); ++c)
        sum += static_cast<double>(harmonics[c]) * harmonics[c];
      EXPECT_NEAR(sum, 1, 1e-5) << l;
    }
  }
}

// A rotation by a about the vertical rotates each pair +-m by m a.
TEST(SphericalHarmonics, RotateWithTheListener) {
  const double a = 0.7;
  for (const Vec3f& from : random_directions(300)) {
    const Vec3f turned(Vec3(std::cos(a) * from.x - std::sin(a) * from.y,
                            std::sin(a) * from.x + std::cos(a) * from.y, from.z));
    const auto before = spherical_harmonics(from), after = spherical_harmonics(turned);
    for (int l = 0; l <= kAmbisonicOrder; ++l)
      for (int m = 0; m <= l; ++m) {
        const auto at = [&](const auto& y, int k) {
          return static_cast<double>(y[static_cast<std::size_t>(l * (l + 1) + k)]);
        };
        const double cosine = std::cos(m * a), sine = std::sin(m * a);
        EXPECT_NEAR(at(after, m), cosine * at(before, m) - (m > 0 ? sine * at(before, -m) : 0),
                    3e-6);
        if (m == 0) continue;
        EXPECT_NEAR(at(after, -m), sine * at(before, m) + cosine * at(before, -m), 3e-6);
      }
  }
}

}  // namespace
}  // namespace clamor
