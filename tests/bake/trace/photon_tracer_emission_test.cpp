// Chi-square tests of the emitted directions and band weights over the whole sphere, against the
// emission law.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "bake/trace/photon_tracer.h"
#include "tests/hemisphere.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

constexpr std::size_t kHeights = 16, kTurns = 16, kCells = kHeights * kTurns;

// ((1 + cos a) / 2)^(p + 1), the share of a lobe's power below cos a.
double share_below(double exponent, double cos_a) {
  return std::pow((1 + cos_a) / 2, exponent + 1);
}

// Heights at which the mixture of the bands gives each cell about the same expectation.
std::array<double, kHeights + 1> edges_of_cells(const Bands& exponents) {
  std::array<double, kHeights + 1> edges{};
  edges[0] = -1, edges[kHeights] = 1;
  for (std::size_t k = 1; k < kHeights; ++k) {
    double low = -1, high = 1;
    for (int step = 0; step < 50; ++step) {
      double below = 0;
      for (const float p : exponents) below += share_below(p, (low + high) / 2) / kBandCount;
      (below < static_cast<double>(k) / kHeights ? low : high) = (low + high) / 2;
    }
    edges[k] = low;
  }
  return edges;
}

// Photons of an emitter by the cell of their direction, and sums of their weights per band.
struct EmissionCells {
  explicit EmissionCells(const Emitter& from)
      : emitter(from),
        basis(basis_around(from.axis)),
        edges(edges_of_cells(from.directivity)),
        drawn(kCells),
        sums(kCells),
        squares(kCells) {}

  void add(const Deposit& deposit) {
    const std::size_t cell = cell_of(normalize(Vec3(deposit.position_m) - emitter.position_m));
    ++drawn[cell];
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double weight = deposit.power[b] / emitted_power(emitter, b);
      sums[cell][b] += weight;
      squares[cell][b] += weight * weight;
    }
  }

  std::size_t cell_of(const Vec3& direction) const {
    const double cos_a = dot(direction, emitter.axis);
    const double turn = std::atan2(dot(direction, basis.bitangent), dot(direction, basis.tangent));
    const auto height = std::min<std::size_t>(
        kHeights - 1,
        static_cast<std::size_t>(std::upper_bound(edges.begin() + 1, edges.end(), cos_a) -
                                 edges.begin() - 1));
    const auto sector = std::min<std::size_t>(
        kTurns - 1, static_cast<std::size_t>((turn / (2 * std::numbers::pi) + 0.5) * kTurns));
    return height * kTurns + sector;
  }

  const Emitter& emitter;
  const Basis basis;
  const std::array<double, kHeights + 1> edges;
  std::vector<double> drawn;
  std::vector<std::array<double, kBandCount>> sums, squares;
};

void check_emission(const Bands& exponents) {
  constexpr std::uint32_t kPhotons = 200 * kRunPhotons;
  Level level = testing::shoebox({2, 2, 2}, testing::uniform_material(0), {1, 1, 1});
  Emitter& emitter = level.emitters[0];
  emitter.axis = {0.36, 0.48, 0.8};
  emitter.gain = 0.7;
  emitter.directivity = exponents;
  const Scene scene(level.mesh);
  const PhotonTracer tracer(scene, level, {.roulette_exponent = 0, .max_bounces = 1});

  EmissionCells cells(emitter);
  TracedRuns traced;
  for (std::uint32_t first = 0; first < kPhotons; first += kRunPhotons) {
    const PhotonRun run{0, first, kRunPhotons};
    traced.clear();
    tracer.trace({&run, 1}, traced);
    for (const Deposit& deposit : traced.deposits()) cells.add(deposit);
  }
  std::vector<double> expected(kCells, 0.0);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const double p = exponents[b];
    double z_squares = 0;
    for (std::size_t c = 0; c < kCells; ++c) {
      const std::size_t height = c / kTurns;
      const double wanted =
          kPhotons / static_cast<double>(kTurns) *
          (share_below(p, cells.edges[height + 1]) - share_below(p, cells.edges[height]));
      expected[c] += wanted / kBandCount;
      // Cells with less than a millionth of the band's power are not tested.
      const double variance = cells.squares[c][b] - cells.sums[c][b] * cells.sums[c][b] / kPhotons +
                              std::pow(1e-6 * kPhotons, 2);
      z_squares += std::pow(cells.sums[c][b] - wanted, 2) / variance;
    }
    // One-sided, because Sobol points are more even than random ones.
    EXPECT_LT((z_squares - kCells) / std::sqrt(2.0 * kCells), 4) << "exponent " << p;
  }
  EXPECT_LT(testing::chi_square_excess(cells.drawn, expected), 4);
}

TEST(Emission, FollowsTheEmissionLawIfAllBandsAreEqual) {
  for (const float exponent : {0.0f, 0.3f, 1.0f, 7.0f, 100.0f})
    check_emission(same_in_all_bands(exponent));
}

TEST(Emission, SamplesTheMixtureOfUnequalBandsAndWeightsEachCorrectly) {
  check_emission({0, 0.5f, 1, 2, 4, 8, 16, 64});
  check_emission({64, 0, 1, 0, 64, 0.1f, 0, 200});
}

}  // namespace
}  // namespace clamor
