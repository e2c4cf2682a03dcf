#include "common/reflection.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"

namespace clamor {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::array<double, 8> kExponents = {0.01, 0.3, 1, 3, 10, 20, 100, 1000};
constexpr std::array<double, 8> kIncidences_deg = {0, 20, 45, 70, 80, 85, 88, 89};

double radians(double degrees) { return degrees * kPi / 180; }

Vec3 off_normal(double cos_o, double azimuth) {
  const double sin_o = std::sqrt(std::max(0.0, 1 - cos_o * cos_o));
  return {sin_o * std::cos(azimuth), sin_o * std::sin(azimuth), cos_o};
}

// Calls visit(direction, weight) for directions whose weights turn a sum of a density into its
// integral over the hemisphere about +Z. Half of the points follow the lobe and half follow
// Lambert, so both are resolved at any exponent; the weights are those of the mixture. Rings lie
// closer towards both ends, because the lobe's share of a ring has square roots there.
template <class Visit>
void over_hemisphere(double exponent, const Vec3& mirror, int rings, int turns, Visit visit) {
  const Basis basis = basis_around(mirror);
  const auto visit_weighted = [&](const Vec3& direction, double share) {
    const double cos_a = dot(direction, mirror), cos_o = direction.z;
    if (cos_o <= 0) return;
    const double lobe = cos_a > 0 ? (exponent + 1) / (2 * kPi) * std::pow(cos_a, exponent) : 0;
    visit(direction, share / (lobe + cos_o / kPi));
  };
  for (int r = 0; r < rings; ++r)
    for (int t = 0; t < turns; ++t) {
      const double phi = 2 * kPi * (t + 0.5) / turns;
      const double x = (r + 0.5) / rings, u = x * x * (3 - 2 * x);
      const double share = 6 * x * (1 - x) / rings / turns;
      const double cos_a = std::pow(u, 1 / (exponent + 1));
      const double sin_a = std::sqrt(1 - cos_a * cos_a);
      visit_weighted(mirror * cos_a + basis.tangent * (sin_a * std::cos(phi)) +
                         basis.bitangent * (sin_a * std::sin(phi)),
                     share);
      visit_weighted(off_normal(std::sqrt(u), phi), share);
    }
}

Material scattering_lobe(double scattering, double exponent) {
  Material material;
  material.scattering = same_in_all_bands(static_cast<float>(scattering));
  material.phong = same_in_all_bands(static_cast<float>(exponent));
  return material;
}

ReflectionLaws laws_of(const Material& material) { return ReflectionLaws(std::span(&material, 1)); }

TEST(Reflection, ReturnsAllEnergyAtEveryExponentAndIncidence) {
  for (const double exponent : kExponents) {
    const PhongLobe lobe(exponent);
    for (const double incidence_deg : kIncidences_deg) {
      const double cos_i = std::cos(radians(incidence_deg));
      const Vec3 mirror = off_normal(cos_i, 0);
      double energy = 0;
      over_hemisphere(exponent, mirror, 300, 150, [&](const Vec3& out, double weight) {
        energy += weight * lobe.density(cos_i, out.z, dot(out, mirror));
      });
      EXPECT_NEAR(energy, 1, 1e-3) << "exponent " << exponent << ", " << incidence_deg << " deg";
    }
  }
}

TEST(Reflection, ReturnsAllEnergyInEveryBandOfAMixedMaterial) {
  Material material;
  material.scattering = {0, 0.1f, 0.2f, 0.5f, 0.9f, 1, 0.3f, 0};
  material.phong = {0, 1, 3, 10, 10, 20, 100, 1000};
  const ReflectionLaws laws = laws_of(material);
  const double cos_i = std::cos(radians(60));
  const Vec3 mirror = off_normal(cos_i, 1);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double energy = 0;
    over_hemisphere(material.phong[b], mirror, 300, 150, [&](const Vec3& out, double weight) {
      energy += weight * laws.density(0, cos_i, out.z, dot(out, mirror))[b];
    });
    EXPECT_NEAR(energy, 1, 1e-3) << "band " << b;
  }
}

TEST(Reflection, IsTheSameEitherWayRound) {
  for (const double exponent : kExponents) {
    const PhongLobe lobe(exponent);
    for (std::uint32_t n = 0; n < 2000; ++n) {
      const RandomBits bits = philox(3, {n, 0, 0, 0});
      const Vec3 in = off_normal(unit_above_zero(bits[0]), 0);  // towards where the sound is from
      // Some departures anywhere, the rest near the mirror direction, where the lobe is.
      const Vec3 anywhere = off_normal(unit_above_zero(bits[1]), 2 * kPi * unit(bits[2]));
      const Vec3 out = normalize(anywhere * (n % 4 == 0 ? 1.0 : 0.05) + Vec3(-in.x, -in.y, in.z));
      const double cos_a = dot(out, Vec3(-in.x, -in.y, in.z));
      const double there = lobe.density(in.z, out.z, cos_a) / out.z;
      const double back = lobe.density(out.z, in.z, cos_a) / in.z;
      EXPECT_NEAR(there / back, 1, 1e-9) << "exponent " << exponent;
    }
  }
}

TEST(Reflection, LosesAtNormalIncidenceWhatTheClosedFormSays) {
  // E at normal incidence is the mean of cos a over the lobe, (p + 1) / (p + 2).
  for (const double p : kExponents) EXPECT_NEAR(PhongLobe(p).albedo(1), (p + 1) / (p + 2), 2e-4);
}

TEST(Reflection, IsLambertWhereTheExponentIsZeroOrScatteringComplete) {
  for (const Material& material : {scattering_lobe(0, 0), scattering_lobe(1, 50)}) {
    const ReflectionLaws laws = laws_of(material);
    for (const double cos_o : {0.1, 0.5, 1.0})
      EXPECT_NEAR(laws.density(0, 0, 0.3, cos_o, 0.9), cos_o / kPi, 1e-12);
  }
}

TEST(Reflection, SendsNothingBelowTheSurface) {
  const ReflectionLaws laws = laws_of(scattering_lobe(0.5, 10));
  EXPECT_EQ(laws.density(0, 3, 0.05, -0.01, 0.99), 0);
  EXPECT_EQ(laws.density(0, 0.05, -0.01, 0.99), Bands{});
}

// Counts departures by angle to the mirror direction (in equal shares of the lobe), by height and
// by the side of the plane of incidence.
struct Histogram {
  static constexpr int kAngles = 12, kHeights = 8;

  explicit Histogram(double exponent) : exponent_(exponent), count(kAngles * kHeights * 2) {}
  double& at(const Vec3& out, const Vec3& mirror) {
    const double cos_a = std::clamp(dot(out, mirror), 0.0, 1.0);
    const int angle = std::min(kAngles - 1, int(std::pow(cos_a, exponent_ + 1) * kAngles));
    const int height = std::min(kHeights - 1, int(out.z * out.z * kHeights));
    return count[(angle * kHeights + height) * 2 + (out.y > 0)];
  }

  double exponent_;
  std::vector<double> count;
};

TEST(Reflection, IsDrawnAsDenselyAsItsDensitySays) {
  constexpr std::uint32_t kDraws = 100000;
  const double scattering = 0.2;
  for (const double exponent : {0.3, 1.0, 10.0, 100.0, 1000.0})
    for (const double incidence_deg : {10.0, 45.0, 80.0, 89.0}) {
      const ReflectionLaws laws = laws_of(scattering_lobe(scattering, exponent));
      const double cos_i = std::cos(radians(incidence_deg));
      const Vec3 arrival = -off_normal(cos_i, kPi), normal(0, 0, 1),
                 mirror = mirrored(arrival, normal);

      Histogram drawn(exponent), expected(exponent);
      for (std::uint32_t n = 0; n < kDraws; ++n) {
        const RandomBits a = philox(7, {n, 0, 0, 0}), b = philox(7, {n, 1, 0, 0});
        const Vec3 out =
            laws.draw(0, 4, arrival, normal,
                      {unit(a[0]), unit(a[1]), unit(a[2]), unit(a[3]), unit(b[0]), unit(b[1])});
        ASSERT_GE(out.z, 0);
        ASSERT_NEAR(length(out), 1, 1e-12);
        ++drawn.at(out, mirror);
      }
      over_hemisphere(exponent, mirror, 1000, 200, [&](const Vec3& out, double weight) {
        expected.at(out, mirror) +=
            kDraws * weight * laws.density(0, 4, cos_i, out.z, dot(out, mirror));
      });

      double chi2 = 0, rest_drawn = 0, rest_expected = 0;
      int cells = 0;
      for (std::size_t c = 0; c < drawn.count.size(); ++c) {
        if (expected.count[c] < 20) {  // too few for the normal law: summed below
          rest_drawn += drawn.count[c];
          rest_expected += expected.count[c];
          continue;
        }
        const double off = drawn.count[c] - expected.count[c];
        chi2 += off * off / expected.count[c];
        ++cells;
      }
      // A right sampler gives `cells` +- sqrt(2 cells); one that forgets the compensation term, or
      // accepts without cos o / cos i, is hundreds off.
      EXPECT_LT(chi2, cells + 4 * std::sqrt(2.0 * cells))
          << "exponent " << exponent << ", " << incidence_deg << " deg, " << cells << " cells";
      EXPECT_NEAR(rest_drawn, rest_expected, 5 * std::sqrt(rest_expected) + 5);
    }
}

TEST(Reflection, NeverExceedsItsPeakDensity) {
  for (const double scattering : {0.0, 0.4})
    for (const double exponent : {0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 20.0, 100.0, 300.0, 1000.0}) {
      const ReflectionLaws laws = laws_of(scattering_lobe(scattering, exponent));
      double highest = 0;
      for (std::uint32_t n = 0; n < 50000; ++n) {
        const RandomBits bits = philox(9, {n, 0, 0, 0});
        const double x = unit_above_zero(bits[0]);
        const double cos_i = n % 2 == 0 ? x : x * x * x;  // half of them near grazing
        const Vec3 mirror = off_normal(cos_i, 0);
        const Vec3 anywhere = off_normal(unit(bits[1]), 2 * kPi * unit(bits[2]));
        const double spread = n % 3 == 0 ? 1e3 : std::pow(10.0, -4 * unit(bits[3]));
        const Vec3 out = normalize(mirror + anywhere * spread);
        highest = std::max(highest, laws.density(0, 0, cos_i, out.z, dot(out, mirror)));
      }
      EXPECT_LE(highest, laws.peak_density(0)[0]) << exponent;
      EXPECT_GT(highest, 0.5 * laws.peak_density(0)[0]) << exponent;  // and is no idle bound
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
    // Starts are spread evenly (Kronecker's sequence in five dimensions, powers of the root of
    // x^6 = x + 1): mirror-like lobes remember them, and their chance would be most of the noise.
    const auto even = [n](int dimension) {
      const double x = 0.5 + n * std::pow(1.1347241384015194, -dimension);
      return x - std::floor(x);
    };
    const double wall = even(1) * half_surface;
    int axis = wall < pair_area.x ? 0 : wall < pair_area.x + pair_area.y ? 1 : 2;
    Vec3 at(0), normal(0);
    at[(axis + 1) % 3] = even(2) * size_m[(axis + 1) % 3];
    at[(axis + 2) % 3] = even(3) * size_m[(axis + 2) % 3];
    normal[axis] = 1;  // by symmetry, one wall of each pair will do
    const double cos_o = std::sqrt(1 - even(4));
    const Basis basis = basis_around(normal);
    const double sin_o = std::sqrt(1 - cos_o * cos_o), phi = 2 * kPi * even(5);
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
      if (bounce > 1) {  // the first chord has seen no reflection
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

TEST(Reflection, LeavesADiffuseFieldDiffuse) {
  const Vec3 size_m(5, 4, 3);
  const double volume_m3 = 60, surface_m2 = 94;
  for (const double exponent : {1.0, 10.0, 1000.0}) {
    // The nearer to a mirror, the longer a photon keeps to its walls and the more of them it takes
    // for noise of about 0.1 %. Other ways to keep a Phong lobe above the surface are 1 to 8 % off
    // in the chord and 5 % in the walls.
    const std::uint32_t photons = exponent > 100 ? 200000 : 60000;
    const Wander after = wander(size_m, laws_of(scattering_lobe(0, exponent)), photons, 40);
    EXPECT_NEAR(after.mean_chord_m / (4 * volume_m3 / surface_m2), 1, 0.003) << exponent;
    EXPECT_NEAR(after.wall_shares.x / (24 / surface_m2), 1, 0.003) << exponent;
    EXPECT_NEAR(after.wall_shares.y / (30 / surface_m2), 1, 0.003) << exponent;
    EXPECT_NEAR(after.wall_shares.z / (40 / surface_m2), 1, 0.003) << exponent;
  }
}

TEST(Mirrored, TurnsRoundOnlyWhatGoesAlongTheNormal) {
  const Vec3 arrival = normalize(Vec3(1, -2, 3));
  EXPECT_NEAR(length(mirrored(arrival, Vec3(0, 1, 0)) - normalize(Vec3(1, 2, 3))), 0, 1e-15);
}

}  // namespace
}  // namespace clamor
