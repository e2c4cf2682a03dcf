// reflection_draws_test.cpp: chi-square tests of the samplers of the reflection law.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "common/reflection.h"
#include "tests/hemisphere.h"

namespace clamor {
namespace {

using testing::DirectionCells;
using testing::off_normal;
using testing::over_hemisphere;
using testing::radians;

TEST(ReflectionDraws, FollowTheDensity) {
  constexpr std::uint32_t kDraws = 100000;
  for (const double exponent : {0.01, 0.3, 2.7, 10.0, 100.0, 1000.0}) {
    Material material;
    material.scattering = same_in_all_bands(0.2f);
    material.phong = same_in_all_bands(static_cast<float>(exponent));
    const ReflectionLaws laws(std::span(&material, 1));
    for (const double incidence_deg : {10.0, 45.0, 80.0, 89.0}) {
      const double cos_i = std::cos(radians(incidence_deg));
      const Vec3 arrival = -off_normal(cos_i, std::numbers::pi), normal(0, 0, 1);
      const Vec3 mirror = mirrored(arrival, normal);
      const DirectionCells cells(mirror);
      std::vector<double> drawn(cells.size()), expected(cells.size());
      for (std::uint32_t n = 0; n < kDraws; ++n) {
        const RandomBits a = philox(7, {n, 0, 0, 0}), b = philox(7, {n, 1, 0, 0});
        const Vec3 out =
            laws.draw(0, 4, arrival, normal,
                      {unit(a[0]), unit(a[1]), unit(a[2]), unit(a[3]), unit(b[0]), unit(b[1])});
        ASSERT_GE(out.z, 0);
        ASSERT_NEAR(length(out), 1, 1e-12);
        ++drawn[cells.of(out)];
      }
      const std::array<double, 3> lobes = {exponent, 30, 1000};  // for narrow cells
      over_hemisphere(lobes, mirror, 50000, [&](const Vec3& out, double weight) {
        expected[cells.of(out)] +=
            kDraws * weight * laws.density(0, 4, cos_i, out.z, dot(out, mirror));
      });
      // A correct sampler is within a few standard deviations; without the compensation term or the
      // factor cos o / cos i it is off by hundreds.
      EXPECT_LT(testing::chi_square_excess(drawn, expected), 4)
          << "exponent " << exponent << ", " << incidence_deg << " degrees";
    }
  }
}

TEST(ReflectionDraws, OfTheCompensationTermFollowTheLobesLoss) {
  constexpr std::uint32_t kDraws = 200000, kSlices = 64;
  for (const double exponent : {0.01, 1.0, 10.0, 100.0, 1000.0}) {
    const PhongLobe lobe(exponent);
    std::vector<double> drawn(kSlices), expected(kSlices);
    for (std::uint32_t n = 0; n < kDraws; ++n) {
      const float u = static_cast<float>(philox(8, {n, 0, 0, 0})[0] >> 8) * 0x1p-24f;
      const double mu = lobe.draw_compensation_cos(u);
      ASSERT_GE(mu, 0);
      ASSERT_LE(mu, 1);
      ++drawn[std::min(kSlices - 1, static_cast<std::uint32_t>(mu * kSlices))];
    }
    double lost = 0;
    for (std::uint32_t slice = 0; slice < kSlices; ++slice)
      for (int step = 0; step < 100; ++step) {
        const double mu = (slice + (step + 0.5) / 100) / kSlices;
        expected[slice] += (1 - lobe.albedo(mu)) * mu;
        lost += (1 - lobe.albedo(mu)) * mu;
      }
    for (double& share : expected) share *= kDraws / lost;
    EXPECT_LT(std::abs(testing::chi_square_excess(drawn, expected)), 4) << "exponent " << exponent;
    // The mean loss over all angles equals the mean albedo.
    EXPECT_NEAR(2 * lost / (kSlices * 100), 1 - lobe.mean_albedo(), 2e-5)
        << "exponent " << exponent;
  }
}

}  // namespace
}  // namespace clamor
