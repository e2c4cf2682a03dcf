// Directions and band weights from the trace kernel itself, in single precision and with its own
// tables, against the reference BRDF.
#include "bake/trace/trace_kernel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "bake/trace/sobol.h"
#include "common/reflection.h"
#include "tests/box_mesh.h"
#include "tests/hemisphere.h"

namespace clamor {
namespace {

using testing::chi_square_excess;
using testing::DirectionCells;
using testing::over_hemisphere;
using testing::radians;
using testing::uniform_material;

constexpr std::uint32_t kDraws = 128 * kStepPhotons;
constexpr Bands kEven = {1, 1, 1, 1, 1, 1, 1, 1};

// Next directions of photons that arrived at the plane z = 0 from above at one angle.
struct Departures {
  std::vector<Vec3> directions;  // z < 0: transmitted
  std::vector<Bands> weights;
  double lost = 0;  // photons ended by roulette
};

Departures depart(const Material& material, double cos_i, std::uint32_t bounce,
                  const Bands& weights = kEven, float exponent = 0) {
  const ReflectionLaws laws(std::span(&material, 1));
  const auto materials = kernel_materials(std::span(&material, 1), laws);
  const KernelSettings settings{.roulette_exponent = exponent, .max_path_m = 1e9};
  const auto scratch = make_shade_scratch();
  const auto sin_i = static_cast<float>(std::sqrt(1 - cos_i * cos_i));
  const Ray ray{{0, 0, 1}, {sin_i, 0, static_cast<float>(-cos_i)}};
  const SurfaceHit hit{.normal = {0, 0, 1},
                       .cos_i = static_cast<float>(cos_i),
                       .distance_m = static_cast<float>(1 / cos_i),
                       .material = 0};
  std::vector<Deposit> deposits(2 * kStepPhotons);
  std::vector<std::uint16_t> runs(2 * kStepPhotons);
  Departures result;
  for (std::uint32_t first = 0; first < kDraws; first += kStepPhotons) {
    std::vector<KernelPhoton> photons(kStepPhotons);
    std::vector<std::uint16_t> alive(kStepPhotons);
    std::vector<Ray> rays(kStepPhotons, ray);
    const std::vector<SurfaceHit> hits(kStepPhotons, hit);
    std::vector<KernelRun> kernel_runs(1);
    for (std::uint32_t i = 0; i < kStepPhotons; ++i) {
      KernelPhoton& photon = photons[i];
      photon.power = kEven;
      photon.weight = weights;
      photon.number = first + i;
      photon.key = 0x123456789abcdef;
      const auto sobol = sobol_point(photon.key, first + i);
      photon.first_bounce = {static_cast<float>(sobol[2]), static_cast<float>(sobol[3])};
      alive[i] = static_cast<std::uint16_t>(i);
    }
    DepositSink sink{deposits.data(), runs.data(), 0};
    const std::size_t survivors =
        shade(settings, materials, bounce, photons, alive, rays, hits, kernel_runs, *scratch, sink);
    result.lost += static_cast<double>(kStepPhotons - survivors);
    for (std::size_t k = 0; k < survivors; ++k) {
      result.directions.emplace_back(rays[k].direction);
      result.weights.push_back(photons[alive[k]].weight);
    }
  }
  return result;
}

Vec3 mirror_of(double cos_i) { return {std::sqrt(1 - cos_i * cos_i), 0, cos_i}; }

// Distribution of each band's reflected power over the cells; sums to 1.
std::vector<std::array<double, kBandCount>> shares(const Material& material, double cos_i) {
  const ReflectionLaws laws(std::span(&material, 1));
  std::vector<double> exponents(material.phong.begin(), material.phong.end());
  exponents.erase(std::unique(exponents.begin(), exponents.end()), exponents.end());
  if (exponents.size() == 1) exponents.insert(exponents.end(), {30, 1000});  // needs narrow cells
  const Vec3 mirror = mirror_of(cos_i);
  const DirectionCells cells(mirror);
  std::vector<std::array<double, kBandCount>> shares(cells.size());
  over_hemisphere(exponents, mirror, 50000, [&](const Vec3& out, double weight) {
    const Bands density = laws.density(0, cos_i, out.z, dot(out, mirror));
    std::array<double, kBandCount>& cell = shares[cells.of(out)];
    for (std::size_t b = 0; b < kBandCount; ++b)
      cell[b] += weight * static_cast<double>(density[b]);
  });
  return shares;
}

TEST(TraceKernel, SamplesDirectionsFromTheBrdf_NoAsan) {
  for (const double exponent : {0.0, 0.3, 10.0, 100.0, 1000.0}) {
    const Material material = uniform_material(0, 0.2f, static_cast<float>(exponent));
    for (const double incidence_deg : {20.0, 80.0, 89.0}) {
      const double cos_i = std::cos(radians(incidence_deg));
      std::vector<double> expected;
      for (const auto& share : shares(material, cos_i)) expected.push_back(kDraws * share[4]);
      for (const std::uint32_t bounce : {1u, 7u}) {  // the first bounce uses Sobol points
        const Departures departures = depart(material, cos_i, bounce);
        EXPECT_EQ(departures.lost, 0);
        const DirectionCells cells(mirror_of(cos_i));
        std::vector<double> drawn(cells.size());
        for (const Vec3& out : departures.directions) {
          ASSERT_NEAR(length(out), 1, 1e-6);
          ++drawn[cells.of(out)];
        }
        EXPECT_LT(chi_square_excess(drawn, expected), 4)
            << "exponent " << exponent << ", " << incidence_deg << " degrees, bounce " << bounce;
      }
    }
  }
}

// A mirror has one direction. What it scatters follows Lambert's law, and each band has its share.
TEST(TraceKernel, MirrorsReflectInOneDirection) {
  Material material = uniform_material(0, 0, kMirrorExponent);
  material.scattering = {0, 0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f, 0.7f};
  for (const double incidence_deg : {0.0, 30.0, 75.0, 89.0}) {
    const double cos_i = std::cos(radians(incidence_deg));
    const Departures departures = depart(material, cos_i, 7);
    EXPECT_EQ(departures.lost, 0);
    Bands mirrored{};
    double scattered = 0, cosines = 0;
    for (std::size_t i = 0; i < departures.directions.size(); ++i) {
      const Vec3& out = departures.directions[i];
      if (length(out - mirror_of(cos_i)) < 1e-6) {
        for (std::size_t b = 0; b < kBandCount; ++b)
          mirrored[b] += departures.weights[i][b] / static_cast<float>(kDraws);
      } else {
        ++scattered;
        cosines += out.z;
      }
    }
    for (std::size_t b = 0; b < kBandCount; ++b)
      EXPECT_NEAR(mirrored[b], 1 - material.scattering[b], 0.02) << incidence_deg << ", " << b;
    EXPECT_NEAR(cosines / scattered, 2.0 / 3, 0.01) << incidence_deg;
  }
}

// Directions follow the mixture of the bands' BRDFs under the path's weights. The new weights,
// summed over any cell, give each band's own share of it.
TEST(TraceKernel, SamplesTheMixtureOfBandsAndReweightsEachToItsBrdf_NoAsan) {
  Material material = uniform_material(0);
  material.scattering = {0.1f, 0.9f, 0, 0.3f, 0.5f, 0.2f, 0, 0.05f};
  material.phong = {0, 1, 3, 10, 30, 100, 300, 1000};
  for (const double incidence_deg : {30.0, 75.0, 88.0}) {
    const double cos_i = std::cos(radians(incidence_deg));
    const auto of_bands = shares(material, cos_i);
    for (const Bands& weights : {kEven, Bands{3, 0.02f, 0.5f, 0.25f, 1.23f, 0.5f, 2, 0.5f}}) {
      const DirectionCells cells(mirror_of(cos_i));
      const Departures departures = depart(material, cos_i, 3, weights);
      EXPECT_EQ(departures.lost, 0);
      std::vector<double> drawn(cells.size()), mixture(cells.size());
      std::vector<std::array<double, kBandCount>> sums(cells.size()), squares(cells.size());
      for (std::size_t i = 0; i < departures.directions.size(); ++i) {
        const std::size_t cell = cells.of(departures.directions[i]);
        ++drawn[cell];
        double all = 0;
        for (std::size_t b = 0; b < kBandCount; ++b) {
          const double weight = departures.weights[i][b];
          sums[cell][b] += weight;
          squares[cell][b] += weight * weight;
          all += weight;
        }
        ASSERT_NEAR(all, kBandCount, 1e-5);
      }
      for (std::size_t b = 0; b < kBandCount; ++b) {
        double z_squares = 0, tested = 0;
        for (std::size_t c = 0; c < cells.size(); ++c) {
          const double expected = kDraws * static_cast<double>(weights[b]) * of_bands[c][b];
          mixture[c] += expected / kBandCount;
          if (drawn[c] < 400) continue;
          const double variance = squares[c][b] - sums[c][b] * sums[c][b] / kDraws;
          z_squares += std::pow(sums[c][b] - expected, 2) / variance;
          ++tested;
        }
        EXPECT_GT(tested, 20);
        EXPECT_LT((z_squares - tested) / std::sqrt(2 * tested), 4)
            << "band " << b << ", " << incidence_deg << " degrees";
      }
      EXPECT_LT(chi_square_excess(drawn, mixture), 4) << incidence_deg << " degrees";
    }
  }
}

// Transmitted power continues straight, with the same lobe around that direction. The side is
// sampled, too, and the weights correct for it per band.
TEST(TraceKernel, TransmitsPhotonsWithTheMaterialsShareAndLobe_NoAsan) {
  Material material = uniform_material(0.6f, 0.2f, 20);
  material.transmission = {0.02f, 0.05f, 0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f};
  const Bands weights = {2, 0.5f, 1, 1, 0.5f, 1, 1.5f, 0.5f};
  for (const double incidence_deg : {0.0, 60.0, 85.0}) {
    const double cos_i = std::cos(radians(incidence_deg));
    const DirectionCells cells(mirror_of(cos_i));
    const Departures departures = depart(material, cos_i, 4, weights);
    EXPECT_EQ(departures.lost, 0);
    double odds = 0;  // probability of transmission
    std::array<double, kBandCount> through{};
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double transmitted = material.transmission[b], reflected = 1 - material.absorption[b];
      through[b] = transmitted / (transmitted + reflected);
      odds += weights[b] * through[b] / kBandCount;
    }
    std::vector<double> above(cells.size()), below(cells.size());
    std::array<double, kBandCount> through_weight{}, squares{};
    for (std::size_t i = 0; i < departures.directions.size(); ++i) {
      Vec3 out = departures.directions[i];
      if (out.z > 0) {
        ++above[cells.of(out)];
        continue;
      }
      out.z = -out.z;  // makes the straight direction the mirror direction
      ++below[cells.of(out)];
      for (std::size_t b = 0; b < kBandCount; ++b) {
        through_weight[b] += departures.weights[i][b];
        squares[b] += std::pow(departures.weights[i][b], 2);
      }
    }
    std::vector<double> expected_above, expected_below;
    for (const auto& share : shares(material, cos_i)) {
      expected_above.push_back(kDraws * share[0] * (1 - odds));
      expected_below.push_back(kDraws * share[0] * odds);
    }
    EXPECT_LT(chi_square_excess(above, expected_above), 4) << incidence_deg << " degrees";
    EXPECT_LT(chi_square_excess(below, expected_below), 4) << incidence_deg << " degrees";
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double spread = std::sqrt(squares[b] - through_weight[b] * through_weight[b] / kDraws);
      EXPECT_NEAR(through_weight[b], kDraws * weights[b] * through[b], 4 * spread) << "band " << b;
    }
  }
}

TEST(TraceKernel, EndsPhotonsWithTheRouletteProbability) {
  Material material = uniform_material(0.4f);
  material.absorption[6] = 0.3f;  // the loudest band after the surface decides
  for (const float exponent : {0.15f, 0.5f, 1.0f}) {
    const double odds = std::pow(0.7, static_cast<double>(exponent));
    const double lost = depart(material, 0.5, 2, kEven, exponent).lost;
    EXPECT_NEAR(lost, kDraws * (1 - odds), 4 * std::sqrt(kDraws * odds * (1 - odds))) << exponent;
  }
}

}  // namespace
}  // namespace clamor
