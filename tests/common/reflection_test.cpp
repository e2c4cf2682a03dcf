#include "common/reflection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "tests/hemisphere.h"

namespace clamor {
namespace {

constexpr std::array<double, 8> kExponents = {0.01, 0.3, 1, 3, 10, 20, 100, 1000};

using testing::off_normal;
using testing::over_hemisphere;
using testing::radians;

Material scattering_lobe(double scattering, double exponent) {
  Material material;
  material.scattering = same_in_all_bands(static_cast<float>(scattering));
  material.phong = same_in_all_bands(static_cast<float>(exponent));
  return material;
}

ReflectionLaws laws_of(const Material& material) { return ReflectionLaws(std::span(&material, 1)); }

TEST(Reflection, ConservesEnergyInEveryBandOfAMixedMaterial) {
  Material material;
  material.scattering = {0, 0.1f, 0.2f, 0.5f, 0.9f, 1, 0.3f, 0};
  material.phong = {0, 1, 3, 10, 10, 20, 100, 1000};
  const ReflectionLaws laws = laws_of(material);
  const double cos_i = std::cos(radians(60));
  const Vec3 mirror = off_normal(cos_i, 1);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double energy = 0;
    over_hemisphere(material.phong[b], mirror, 40000, [&](const Vec3& out, double weight) {
      energy += weight * laws.density(0, cos_i, out.z, dot(out, mirror))[b];
    });
    EXPECT_NEAR(energy, 1, 1e-3) << "band " << b;
  }
}

TEST(Reflection, IsReciprocal) {
  for (const double exponent : kExponents) {
    const PhongLobe lobe(exponent);
    for (std::uint32_t n = 0; n < 2000; ++n) {
      const RandomBits bits = philox(3, {n, 0, 0, 0});
      const Vec3 in = off_normal(unit_above_zero(bits[0]), 0);  // towards the source
      // Some departures are uniform, the others near the mirror direction.
      const Vec3 anywhere =
          off_normal(unit_above_zero(bits[1]), 2 * std::numbers::pi * unit(bits[2]));
      const Vec3 out = normalize(anywhere * (n % 4 == 0 ? 1.0 : 0.05) + Vec3(-in.x, -in.y, in.z));
      const double cos_a = dot(out, Vec3(-in.x, -in.y, in.z));
      const double there = lobe.density(in.z, out.z, cos_a) / out.z;
      const double back = lobe.density(out.z, in.z, cos_a) / in.z;
      EXPECT_NEAR(there / back, 1, 1e-9) << "exponent " << exponent;
    }
  }
}

TEST(Reflection, HasTheClosedFormAlbedoAtNormalIncidence) {
  // E at normal incidence is the mean of cos a over the lobe, (p + 1) / (p + 2).
  for (const double p : kExponents) EXPECT_NEAR(PhongLobe(p).albedo(1), (p + 1) / (p + 2), 5e-6);
}

// The mean of [cos o > 0] min(1, cos o / cos i) over the lobe, on a grid of directions.
double fine_albedo(double exponent, double cos_i) {
  constexpr int kRings = 4000, kTurns = 500;
  const double sin_i = std::sqrt(1 - cos_i * cos_i);
  double sum = 0;
  for (int r = 0; r < kRings; ++r) {
    const double cos_a = std::pow((r + 0.5) / kRings, 1 / (exponent + 1));
    const double swing = std::sqrt(1 - cos_a * cos_a) * sin_i;
    for (int t = 0; t < kTurns; ++t) {
      const double cos_o = cos_a * cos_i + swing * std::cos(std::numbers::pi * (t + 0.5) / kTurns);
      sum += std::clamp(cos_o / cos_i, 0.0, 1.0);
    }
  }
  return sum / (static_cast<double>(kRings) * kTurns);
}

TEST(Reflection, HasTheAlbedoOfAFineSum) {
  for (const double exponent : {0.01, 1.0, 20.0, 1000.0})
    for (const double root : {0.125, 0.5, 0.9375, 0.9921875})  // where the table has a value
      EXPECT_NEAR(PhongLobe(exponent).albedo(root * root), fine_albedo(exponent, root * root), 1e-5)
          << "exponent " << exponent << ", cosine " << root * root;
}

// The loss decreases at least exponentially from grazing angles towards the normal.
TEST(Reflection, HasATightExponentialBoundOnItsLoss) {
  for (const double exponent : kExponents) {
    const PhongLobe lobe(exponent);
    double steepest = std::numeric_limits<double>::infinity();
    for (int n = 1; n <= 2000; ++n) {
      const double cos_o = n / 2000.0, share = (1 - lobe.albedo(cos_o)) / (1 - lobe.min_albedo());
      EXPECT_LE(share, std::exp(-lobe.loss_slope() * cos_o)) << exponent << " at " << cos_o;
      steepest = std::min(steepest, -std::log(share) / cos_o);
    }
    EXPECT_GT(lobe.loss_slope(), 0.97 * steepest) << exponent;
  }
}

TEST(Reflection, RoundsExponentsToThreeDigits) {
  PhongLobes lobes;
  const auto lobe_of = [&](double exponent) { return lobes.of(scattering_lobe(0, exponent), 3); };
  for (const float exact : {0.001f, 0.3f, 2.7f, 20.0f, 99.9f, 100.0f, 316.0f, 1000.0f})
    EXPECT_EQ(lobe_of(exact)->exponent(), static_cast<double>(exact));
  EXPECT_EQ(lobe_of(20.04), lobe_of(20));
  EXPECT_EQ(lobe_of(999.6), lobe_of(1000));
  EXPECT_EQ(lobe_of(1e-30), lobe_of(0.001));
  EXPECT_NE(lobe_of(20.06), lobe_of(20));
}

// The number of lobes is bounded for any number of materials, because each costs time and memory.
TEST(Reflection, SharesLobesBetweenSimilarExponents) {
  std::vector<Material> materials(5000);
  for (std::size_t m = 0; m < materials.size(); ++m) {
    materials[m].scattering = same_in_all_bands(0);
    for (std::size_t b = 0; b < kBandCount; ++b)
      materials[m].phong[b] = 400 + 0.002f * static_cast<float>(kBandCount * m + b);
  }
  const ReflectionLaws laws(materials);
  EXPECT_EQ(laws.lobe_count(), 81);
}

TEST(Reflection, IsLambertForZeroExponentOrFullScattering) {
  for (const Material& material : {scattering_lobe(0, 0), scattering_lobe(1, 50)}) {
    const ReflectionLaws laws = laws_of(material);
    for (const double cos_o : {0.1, 0.5, 1.0})
      EXPECT_NEAR(laws.density(0, 0, 0.3, cos_o, 0.9), cos_o / std::numbers::pi, 1e-12);
  }
}

TEST(Reflection, SendsNothingBelowTheSurface) {
  const ReflectionLaws laws = laws_of(scattering_lobe(0.5, 10));
  EXPECT_EQ(laws.density(0, 3, 0.05, -0.01, 0.99), 0);
  EXPECT_EQ(laws.density(0, 0.05, -0.01, 0.99), Bands{});
}

TEST(Reflection, NeverExceedsItsPeakDensity) {
  for (const double scattering : {0.0, 0.4})
    for (const double exponent : {0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 20.0, 100.0, 300.0, 1000.0}) {
      const ReflectionLaws laws = laws_of(scattering_lobe(scattering, exponent));
      double highest = 0;
      for (std::uint32_t n = 0; n < 50000; ++n) {
        const RandomBits bits = philox(9, {n, 0, 0, 0});
        const double x = unit_above_zero(bits[0]);
        const double cos_i = n % 2 == 0 ? x : x * x * x;  // half near grazing
        const Vec3 mirror = off_normal(cos_i, 0);
        const Vec3 anywhere = off_normal(unit(bits[1]), 2 * std::numbers::pi * unit(bits[2]));
        const double spread = n % 3 == 0 ? 1e3 : std::pow(10.0, -4 * unit(bits[3]));
        const Vec3 out = normalize(mirror + anywhere * spread);
        highest = std::max(highest, laws.density(0, 0, cos_i, out.z, dot(out, mirror)));
      }
      EXPECT_LE(highest, laws.peak_density(0)[0]) << exponent;
      EXPECT_GT(highest, 0.5 * laws.peak_density(0)[0]) << exponent;  // the bound is tight
    }
}

// Photons bounce in a closed box, started in its equilibrium: uniform on the walls, cosine law.
struct Wander {
  double mean_chord_m = 0;
  Vec3 wall_shares{0};  // of the pairs of walls across x, y and z
};

Wander wander(const Vec3& size_m, const ReflectionLaws& laws, std::uint32_t photons, int bounces) {
  const Vec3 pair_area(size_m.y * size_m.z, size_m.z * size_m.x, size_m.x * size_m.y);
  const double half_surface = pair_area.x + pair_area.y + pair_area.z;
  Wander result;
  for (std::uint32_t n = 0; n < photons; ++n) {
    // Starts follow a low-discrepancy Kronecker sequence in five dimensions (powers of the root of
    // x^6 = x + 1), because mirror-like lobes preserve them and random starts would dominate the
    // noise.
    const auto even = [n](int dimension) {
      const double x = 0.5 + n * std::pow(1.1347241384015194, -dimension);
      return x - std::floor(x);
    };
    const double wall = even(1) * half_surface;
    int axis = wall < pair_area.x ? 0 : wall < pair_area.x + pair_area.y ? 1 : 2;
    Vec3 at(0), normal(0);
    at[(axis + 1) % 3] = even(2) * size_m[(axis + 1) % 3];
    at[(axis + 2) % 3] = even(3) * size_m[(axis + 2) % 3];
    normal[axis] = 1;  // by symmetry, one wall per pair suffices
    const double cos_o = std::sqrt(1 - even(4));
    const Basis basis = basis_around(normal);
    const double sin_o = std::sqrt(1 - cos_o * cos_o), phi = 2 * std::numbers::pi * even(5);
    Vec3 direction = normal * cos_o + basis.tangent * (sin_o * std::cos(phi)) +
                     basis.bitangent * (sin_o * std::sin(phi));
    for (int bounce = 1; bounce <= bounces; ++bounce) {
      double chord_m = 1e9;
      for (int k = 0; k < 3; ++k) {
        if (direction[k] == 0) continue;
        const double to_wall = ((direction[k] > 0 ? size_m[k] : 0) - at[k]) / direction[k];
        if (to_wall < chord_m) chord_m = to_wall, axis = k;
      }
      at += direction * chord_m;
      normal = Vec3(0);
      normal[axis] = direction[axis] > 0 ? -1 : 1;
      at[axis] = direction[axis] > 0 ? size_m[axis] : 0;
      if (bounce > 1) {  // the first chord precedes any reflection
        result.mean_chord_m += chord_m;
        result.wall_shares[axis] += 1;
      }
      const auto step = static_cast<std::uint32_t>(bounce);
      const RandomBits c = philox(22, {n, step, 0, 0}), d = philox(22, {n, step, 1, 0});
      direction = normalize(
          laws.draw(0, 0, direction, normal,
                    {unit(c[0]), unit(c[1]), unit(c[2]), unit(c[3]), unit(d[0]), unit(d[1])}));
    }
  }
  const double legs = static_cast<double>(photons) * (bounces - 1);
  result.mean_chord_m /= legs;
  result.wall_shares /= legs;
  return result;
}

TEST(Reflection, PreservesADiffuseField) {
  const Vec3 size_m(5, 4, 3);
  const double volume_m3 = 60, surface_m2 = 94;
  for (const double exponent : {1.0, 10.0, 1000.0}) {
    // Sharper lobes keep photons at the same walls for longer, so noise of 0.1 % needs more
    // photons. Other ways to confine a Phong lobe to the hemisphere have errors of 1 to 8 % in the
    // chord and 5 % in the walls.
    const std::uint32_t photons = exponent > 100 ? 200000 : 60000;
    const Wander after = wander(size_m, laws_of(scattering_lobe(0, exponent)), photons, 40);
    EXPECT_NEAR(after.mean_chord_m / (4 * volume_m3 / surface_m2), 1, 0.003) << exponent;
    EXPECT_NEAR(after.wall_shares.x / (24 / surface_m2), 1, 0.003) << exponent;
    EXPECT_NEAR(after.wall_shares.y / (30 / surface_m2), 1, 0.003) << exponent;
    EXPECT_NEAR(after.wall_shares.z / (40 / surface_m2), 1, 0.003) << exponent;
  }
}

TEST(Mirrored, ReversesOnlyTheNormalComponent) {
  const Vec3 arrival = normalize(Vec3(1, -2, 3));
  EXPECT_NEAR(length(mirrored(arrival, Vec3(0, 1, 0)) - normalize(Vec3(1, 2, 3))), 0, 1e-15);
}

}  // namespace
}  // namespace clamor
