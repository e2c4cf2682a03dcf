// All forms of the reflection law against the formula of reflection.h, written out in double.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "common/random.h"
#include "common/reflection.h"
#include "common/reflection_law-inl.h"
#include "common/reflection_table.h"

namespace clamor {
namespace {

namespace law = HWY_NAMESPACE;

Material mixed_material() {
  Material material;
  material.scattering = {0, 0.1f, 0.2f, 0.5f, 0.9f, 1, 0.3f, 0};
  material.phong = {0.01f, 1, 3, 10, 10, 20, 100, 1000};
  return material;
}

double formula(const ReflectionLaws& laws, std::size_t b, double cos_i, double cos_o,
               double cos_a) {
  const double s = laws.scattering(0, b), pi = std::numbers::pi;
  const PhongLobe* const lobe = laws.lobe(0, b);
  if (lobe == nullptr) return cos_o / pi;
  const double p = lobe->exponent();
  const double compensation =
      (1 - lobe->albedo(cos_i)) * (1 - lobe->albedo(cos_o)) / (pi * (1 - lobe->mean_albedo()));
  const double peak = (p + 1) / (2 * pi) * (cos_a > 0 ? std::pow(cos_a, p) : 0);
  return (s / pi + (1 - s) * (peak / std::max(cos_i, cos_o) + compensation)) * cos_o;
}

float loss_at(const ReflectionTable& table, std::size_t b, float cos) {
  const float cell = law::loss_cell_of(cos, 1.0f * ReflectionTable::kCells);
  const int k = ReflectionTable::cell_at(cell);
  const Bands* const row = &table.loss[static_cast<std::size_t>(k)];
  return law::loss_between(row[0][b], row[1][b], cell - static_cast<float>(k));
}

TEST(ReflectionLaw, HasOneDensityInAllFormsAndABoundAboveIt) {
  const Material material = mixed_material();
  const ReflectionLaws laws(std::span(&material, 1));
  const ReflectionTable table = reflection_table(laws, 0);
  const law::hn::CappedTag<float, 1> d;
  for (std::uint32_t n = 0; n < 20000; ++n) {
    const RandomBits bits = philox(1, {n, 0, 0, 0});
    const float cos_i = unit_above_zero(bits[0]), cos_o = unit_above_zero(bits[1]);
    // Half of the directions are near the mirror direction.
    const float u = unit(bits[2]), cos_a = n % 2 == 0 ? 1 - 0.01f * u : 2 * u - 1;
    const float tilt = law::tilt_of(cos_i, cos_o), log_base = law::log2_of_base(cos_a);
    const auto bound = laws.upper_bound(0, cos_i);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double expected = formula(laws, b, cos_i, cos_o, cos_a);
      EXPECT_NEAR(laws.density(0, b, cos_i, cos_o, cos_a), expected, 1e-7 * (1 + expected));
      const float power_of_base = law::exp2_of(table.exponent[b] * log_base), power = 3;
      const float loss_i = loss_at(table, b, cos_i), loss_o = loss_at(table, b, cos_o);
      const double margin = 1e-7 + 2e-4 * expected;  // an exponent of 1000 magnifies rounding
      EXPECT_NEAR(law::density(table.diffuse[b], table.lobe[b], table.compensation[b], cos_o, tilt,
                               power_of_base, loss_i * loss_o),
                  expected, margin);
      EXPECT_NEAR(
          law::radiated(power, table.diffuse[b], table.lobe[b],
                        power * table.compensation[b] * loss_i, cos_o, tilt, power_of_base, loss_o),
          power * expected, power * margin);
      EXPECT_NEAR(law::photon_density(table.scattering[b], table.lobe[b], table.compensation[b],
                                      cos_o, tilt, power_of_base, loss_i, loss_o),
                  expected, margin);
      const auto most = law::density_bound(
          Set(d, bound.diffuse[b]), Set(d, bound.lobe[b]), Set(d, bound.compensation[b]),
          Set(d, bound.slope), Set(d, cos_o), Set(d, tilt), Set(d, bound.exponent * (1 - cos_a)));
      EXPECT_GE(static_cast<double>(GetLane(most)) * 1.0005, expected);
    }
  }
}

// The shares that the lobe's samples and their acceptance lose are those of its albedo.
TEST(ReflectionLaw, AcceptsTheAlbedoOfTheLobe) {
  for (const double exponent : {1.0, 20.0, 300.0}) {
    const PhongLobe lobe(exponent);
    for (const double cos_i : {0.1, 0.5, 1.0}) {
      double accepted = 0;
      constexpr int kSteps = 200;
      for (int j = 0; j < kSteps; ++j)
        for (int k = 0; k < kSteps; ++k) {
          const double cos_a = law::draw_lobe_cos((j + 0.5) / kSteps, 1 / (exponent + 1));
          const double turn = std::cos(2 * std::numbers::pi * (k + 0.5) / kSteps);
          const double cos_o =
              cos_a * cos_i + std::sqrt((1 - cos_a * cos_a) * (1 - cos_i * cos_i)) * turn;
          for (int l = 0; l < 20; ++l) accepted += law::accepts_lobe(cos_i, cos_o, (l + 0.5) / 20);
        }
      EXPECT_NEAR(accepted / (20.0 * kSteps * kSteps), lobe.albedo(cos_i), 5e-3) << exponent;
    }
  }
}

}  // namespace
}  // namespace clamor
