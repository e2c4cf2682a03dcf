// One path carries eight bands: compared with tracing each band alone, and with the equilibrium of
// a closed room.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "bake/trace/photon_tracer.h"
#include "tests/rooms.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

using testing::shoebox;
using testing::uniform_material;

struct Spread {
  std::array<double, kBandCount> mean{}, variance{};  // over photons
};

// Mean and variance of the power that a photon leaves on a part of one wall within five bounces,
// per band.
Spread power_on_the_wall(const Material& material, const Bands& directivity) {
  constexpr std::uint32_t kPhotons = 20 * kRunPhotons;
  Level level = shoebox({5, 4, 3}, material, {1.3, 1.7, 1.1});
  level.emitters[0].axis = {0.6, 0, 0.8};
  level.emitters[0].directivity = directivity;
  const Scene scene(level.mesh);
  const PhotonTracer tracer(scene, level, {.roulette_exponent = 0, .max_bounces = 5});
  Spread spread;
  std::array<double, kBandCount> squares{};
  TracedRuns traced;
  for (std::uint32_t first = 0; first < kPhotons; first += kRunPhotons) {
    const PhotonRun run{0, first, kRunPhotons};
    traced.clear();
    tracer.trace({&run, 1}, traced);
    std::vector<std::array<double, kBandCount>> of_photon(kRunPhotons);
    for (std::size_t i = 0; i < traced.deposits().size(); ++i) {
      const Deposit& deposit = traced.deposits()[i];
      if (deposit.position_m.x < 4.999f || deposit.position_m.y > 2) continue;
      for (std::size_t b = 0; b < kBandCount; ++b)
        of_photon[deposit.photon][b] += static_cast<double>(deposit.power[b]);
    }
    for (const auto& photon : of_photon)
      for (std::size_t b = 0; b < kBandCount; ++b) {
        spread.mean[b] += photon[b] / kPhotons;
        squares[b] += photon[b] * photon[b] / kPhotons;
      }
  }
  for (std::size_t b = 0; b < kBandCount; ++b)
    spread.variance[b] = (squares[b] - spread.mean[b] * spread.mean[b]) / kPhotons;
  return spread;
}

// Traces the bands together and each alone; variances may grow by the factor `most`.
void compare(const Bands& phong, const Bands& directivity, double most) {
  Material material = uniform_material(0.1f, 0.1f);
  material.phong = phong;
  const Spread together = power_on_the_wall(material, directivity);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    Material alone = material;
    alone.phong = same_in_all_bands(phong[b]);
    const Spread one = power_on_the_wall(alone, same_in_all_bands(directivity[b]));
    EXPECT_NEAR(together.mean[b], one.mean[b],
                3 * std::sqrt(together.variance[b] + one.variance[b]))
        << "band " << b;
    EXPECT_LE(together.variance[b], most * one.variance[b]) << "band " << b;
  }
}

TEST(BandMixture, IsUnbiasedAndNeverWorseThanAnEighthOfThePhotonsForUnlikeLobes) {
  compare({0, 1, 3, 10, 30, 100, 300, 1000}, {0, 0, 1, 1, 2, 4, 8, 16}, 8);
  compare({1000, 0, 1000, 0, 1000, 0, 1000, 0}, same_in_all_bands(0), 8);
}

TEST(BandMixture, LosesAlmostNothingForSimilarLobes) {
  compare({18, 19, 20, 21, 22, 20, 19, 21}, {1, 1, 1.1f, 1.1f, 1.2f, 1.1f, 1, 1}, 1.1);
}

// Chi-square of counts with equal expectations, in standard deviations from its mean.
double excess(const std::vector<double>& counts) {
  double sum = 0, chi = 0;
  for (const double count : counts) sum += count;
  const double expected = sum / static_cast<double>(counts.size());
  for (const double count : counts) chi += (count - expected) * (count - expected) / expected;
  const auto freedom = static_cast<double>(counts.size() - 1);
  return (chi - freedom) / std::sqrt(2 * freedom);
}

TEST(TracerSampling, FollowsTheDensities) {
  // In a box whose walls absorb half, seen from the centre, every first deposit shows where its
  // photon went. The deposits' random numbers are uniform, and half of the photons survive analog
  // roulette.
  constexpr std::uint32_t kPhotons = 60 * kRunPhotons;
  Level level = shoebox({2, 2, 2}, uniform_material(0.5f), {1, 1, 1});
  level.emitters[0].axis = {0.36, 0.48, 0.8};
  level.emitters[0].directivity = {0, 0.5f, 1, 2, 4, 8, 16, 32};
  const Scene scene(level.mesh);
  const PhotonTracer tracer(scene, level, {.roulette_exponent = 1, .max_bounces = 2});
  const Basis basis = basis_around(level.emitters[0].axis);
  std::vector<double> cosines(64), turns(64), random(64), departures(32);
  double survived = 0, survivors_expected = 0;
  TracedRuns traced;
  for (std::uint32_t first = 0; first < kPhotons; first += kRunPhotons) {
    const PhotonRun run{0, first, kRunPhotons};
    traced.clear();
    tracer.trace({&run, 1}, traced);
    std::vector<const Deposit*> before(kRunPhotons, nullptr);
    for (std::size_t i = 0; i < traced.deposits().size(); ++i) {
      const Deposit& deposit = traced.deposits()[i];
      random[std::min<std::size_t>(63, static_cast<std::size_t>(64 * deposit.random))] += 1;
      const Deposit*& last = before[deposit.photon];
      if (last == nullptr) {
        last = &deposit;
        const Vec3 way = normalize(Vec3(deposit.position_m) - Vec3(1));
        const double share = (1 + dot(way, level.emitters[0].axis)) / 2;
        double below = 0;  // distribution function of the mixture
        for (const float p : level.emitters[0].directivity)
          below += std::pow(share, static_cast<double>(p) + 1) / 8;
        cosines[std::min<std::size_t>(63, static_cast<std::size_t>(64 * below))] += 1;
        const double turn =
            std::atan2(dot(way, basis.bitangent), dot(way, basis.tangent)) / (2 * std::numbers::pi);
        turns[std::min<std::size_t>(63, static_cast<std::size_t>(64 * (turn + 0.5)))] += 1;
        survivors_expected += 0.5;
      } else {
        ++survived;
        // Lambert: the square of the cosine is uniform.
        const Vec3 way = normalize(Vec3(deposit.position_m) - Vec3(last->position_m));
        const double cos_o = dot(way, Vec3(last->normal));
        departures[std::min<std::size_t>(31, static_cast<std::size_t>(32 * cos_o * cos_o))] += 1;
      }
    }
  }
  // One-sided, because Sobol points are more even than random ones.
  EXPECT_LT(excess(cosines), 4);
  EXPECT_LT(excess(turns), 4);
  EXPECT_LT(excess(departures), 4);
  EXPECT_LT(std::abs(excess(random)), 4);
  EXPECT_NEAR(survived, survivors_expected, 4 * std::sqrt(kPhotons * 0.25));
}

// Photons start in all directions from one point. If the BRDF is reciprocal and conserves energy,
// directions stay isotropic for ever. Photons then hit each wall in proportion to its area, c S /
// 4V times per second.
TEST(Equilibrium, OfAClosedRoomKeepsMeanChordAndWallSharesForEveryExponent) {
  constexpr double kFrom_s = 0.1, kTo_s = 0.35, kSpeed_mps = 343.2;  // bounces 13 to 47
  constexpr std::uint64_t kPhotons = 100 * kRunPhotons;
  const std::array<double, 6> area_m2 = {12, 12, 15, 15, 20, 20};
  for (const float exponent : {0.0f, 3.0f, 1000.0f}) {
    if (testing::kSanitized && exponent != 3) continue;  // slow
    const Level level = shoebox(
        {5, 4, 3}, uniform_material(0, exponent > 0 ? 0.0f : 1.0f, exponent), {1.3, 1.7, 1.1});
    const Scene scene(level.mesh);
    const PhotonTracer tracer(scene, level, {.longest_path_s = kTo_s, .speed_mps = kSpeed_mps});
    std::array<double, 6> hits{};
    double all = 0;
    TracedRuns traced;
    for (std::uint64_t first = 0; first < kPhotons; first += kRunPhotons) {
      const PhotonRun run{0, first, kRunPhotons};
      traced.clear();
      tracer.trace({&run, 1}, traced);
      for (const Deposit& deposit : traced.deposits()) {
        if (static_cast<double>(deposit.delay_s) < kFrom_s) continue;
        const Vec3f inwards = deposit.normal;
        const int axis = std::abs(inwards.x) > 0.5f ? 0 : std::abs(inwards.y) > 0.5f ? 1 : 2;
        ++hits[static_cast<std::size_t>(2 * axis + (inwards[axis] > 0 ? 0 : 1))];
        ++all;
      }
    }
    const double mean_chord_m = kPhotons * kSpeed_mps * (kTo_s - kFrom_s) / all;
    EXPECT_NEAR(mean_chord_m / (4 * 60.0 / 94), 1, 0.003) << "exponent " << exponent;
    for (std::size_t wall = 0; wall < 6; ++wall)
      EXPECT_NEAR(hits[wall] / all / (area_m2[wall] / 94), 1, 0.003)
          << "exponent " << exponent << ", wall " << wall;
  }
}

}  // namespace
}  // namespace clamor
