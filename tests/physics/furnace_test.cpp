// Rooms without absorption (furnace tests): the emitted energy becomes uniform and stays.
//
// If the BRDFs conserve energy and are reciprocal, the energy density becomes the same at every
// point and in every direction, whatever the walls. Every listener then receives, in any time t,
//
//   E = 4 pi c t / V     of an omnidirectional emitter of gain 1,
//
// and every surface is hit by a quarter of that per square metre.
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bake/trace/photon_tracer.h"
#include "runtime/propagation/received_intensity.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

constexpr double kSpeed_mps = 343.2;
constexpr std::uint32_t kRuns = 24;

// Mean and standard error of independent runs.
struct Mean {
  double sum = 0, squares = 0;
  void add(double value) { sum += value, squares += value * value; }
  double value() const { return sum / kRuns; }
  double error() const { return std::sqrt((squares / kRuns - value() * value()) / (kRuns - 1)); }
};

// Emitters at one place; their names give them independent random numbers.
void repeat_emitter(Level& level) {
  level.emitters.resize(kRuns, level.emitters[0]);
  for (std::uint32_t i = 0; i < kRuns; ++i) level.emitters[i].name = std::to_string(i);
}

TEST(Furnace, HasTheLevelGivenByItsVolumeEverywhere) {
  // Bounces 13 to 37.
  constexpr double from_s = 0.1, to_s = 0.28;
  const std::vector<Vec3> listeners_m = {{2.4, 1.9, 1.6}, {0.5, 0.6, 0.4}, {4.4, 3.2, 2.5}};
  for (const float exponent : {0.0f, 1.0f, 5.0f, 20.0f}) {
    Level level = testing::shoebox(
        {5, 4, 3}, testing::uniform_material(0, exponent > 0 ? 0.1f : 1.0f, exponent),
        {1.3, 1.7, 1.1});
    repeat_emitter(level);
    const Scene scene(level.mesh);
    const ReflectionLaws laws(level.materials);
    const PhotonTracer tracer(scene, level, {.longest_path_s = to_s, .speed_mps = kSpeed_mps});
    std::vector<Mean> heard(listeners_m.size());
    for (std::uint32_t run = 0; run < kRuns; ++run) {
      const PhotonRun photons{run, 0, kRunPhotons};
      TracedRuns traced;
      tracer.trace({&photons, 1}, traced);
      for (std::size_t i = 0; i < listeners_m.size(); ++i) {
        double energy = 0;
        for (const Deposit& deposit : traced.deposits()) {
          const double time_s = static_cast<double>(deposit.delay_s) +
                                length(listeners_m[i] - Vec3(deposit.position_m)) / kSpeed_mps;
          if (time_s < from_s || time_s > to_s) continue;
          energy += static_cast<double>(received_intensity(
              secondary_source(deposit, 1), level.emitters, laws, {}, listeners_m[i])[5]);
        }
        const double expected = 4 * std::numbers::pi * kSpeed_mps * (to_s - from_s) / 60;
        heard[i].add(energy / kRunPhotons / expected);
      }
    }
    for (const Mean& mean : heard) {
      EXPECT_NEAR(mean.value(), 1, 4 * mean.error()) << "exponent " << exponent;
      EXPECT_LT(mean.error(), 0.015) << "exponent " << exponent;
    }
  }
}

// Mean chord 4V/S and wall shares of each band, although all bands share their paths.
TEST(Furnace, KeepsUnequalBandsInEquilibrium) {
  constexpr double from_s = 0.1, to_s = 0.3;
  Level level = testing::shoebox({5, 4, 3}, testing::uniform_material(0, 0), {1.3, 1.7, 1.1});
  level.materials[0].phong = {0, 1, 3, 10, 30, 100, 300, 1000};
  repeat_emitter(level);
  const Scene scene(level.mesh);
  const PhotonTracer tracer(scene, level, {.longest_path_s = to_s, .speed_mps = kSpeed_mps});
  // Shares of the hits on the walls across x, y and z, and the number of hits, which gives 4V/S.
  std::array<std::array<Mean, kBandCount>, 4> hits;
  for (std::uint32_t run = 0; run < kRuns; ++run) {
    std::array<std::array<double, kBandCount>, 4> arrived{};
    TracedRuns traced;
    for (std::uint64_t block = 0; block < 4; ++block) {
      const PhotonRun photons{run, block * kRunPhotons, kRunPhotons};
      tracer.trace({&photons, 1}, traced);
    }
    for (const Deposit& deposit : traced.deposits()) {
      if (deposit.delay_s < static_cast<float>(from_s)) continue;
      const std::size_t axis = std::abs(deposit.normal.x) > 0.5f   ? 0
                               : std::abs(deposit.normal.y) > 0.5f ? 1
                                                                   : 2;
      for (std::size_t b = 0; b < kBandCount; ++b) {
        arrived[axis][b] += static_cast<double>(deposit.power[b]);
        arrived[3][b] += static_cast<double>(deposit.power[b]);
      }
    }
    constexpr std::array<double, 4> kArea_m2 = {24, 30, 40, 94};
    const double expected = 4 * std::numbers::pi * kSpeed_mps * (to_s - from_s) / (4 * 60) *
                            kArea_m2[3] * 4 * kRunPhotons;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      for (std::size_t k = 0; k < 3; ++k)
        hits[k][b].add(arrived[k][b] / arrived[3][b] / (kArea_m2[k] / kArea_m2[3]));
      hits[3][b].add(arrived[3][b] / expected);
    }
  }
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const Mean& mean = hits[k][b];
      EXPECT_NEAR(mean.value(), 1, 4 * mean.error()) << "walls " << k << ", band " << b;
      EXPECT_LT(mean.error(), k < 3 ? 0.008 : 0.02) << "walls " << k << ", band " << b;
    }
}

TEST(Furnace, WithATransmittingWallHasEqualLevelsOnBothSides) {
  // Two rooms of 24 and 48 m^3 equalise as exp(-t c A T (1 / 24 + 1 / 48) / 4), to 0.05 % by then.
  constexpr double from_s = 0.3, to_s = 0.45;
  Level level = testing::shoebox({6, 4, 3}, testing::uniform_material(0, 0.3f, 10), {1.1, 2, 1.2});
  testing::add_wall_across(level.mesh, 2, {6, 4, 3}, 1);
  Material thin = testing::uniform_material(0, 0.3f, 10);
  thin.transmission = {0.4f, 0.45f, 0.5f, 0.55f, 0.6f, 0.65f, 0.7f, 0.8f};
  thin.absorption = thin.transmission;  // transmits everything that it does not reflect
  level.materials.push_back(thin);
  repeat_emitter(level);
  const Scene scene(level.mesh);
  const PhotonTracer tracer(scene, level, {.longest_path_s = to_s, .speed_mps = kSpeed_mps});

  // Walls of the small room, walls of the large room, and both sides of the wall between them.
  std::array<std::array<Mean, kBandCount>, 4> hits;
  for (std::uint32_t run = 0; run < kRuns; ++run) {
    TracedRuns traced;
    for (std::uint64_t block = 0; block < 4; ++block) {
      const PhotonRun photons{run, block * kRunPhotons, kRunPhotons};
      tracer.trace({&photons, 1}, traced);
    }
    std::array<std::array<double, kBandCount>, 4> arrived{};
    for (const Deposit& deposit : traced.deposits()) {
      if (deposit.delay_s < static_cast<float>(from_s) || std::abs(deposit.normal.x) < 0.5f)
        continue;
      const std::size_t wall = deposit.position_m.x < 1 ? 0 : deposit.position_m.x > 3 ? 1 : 2;
      // Power that arrives at one side of the thin wall is deposited partly on each side. In
      // equilibrium, the power deposited on a side therefore equals the power arriving there.
      const std::size_t side = wall == 2 && deposit.normal.x > 0 ? 3 : wall;
      for (std::size_t b = 0; b < kBandCount; ++b) arrived[side][b] += deposit.power[b];
    }
    // A quarter of the fluence on 12 m^2.
    const double expected =
        4 * std::numbers::pi * kSpeed_mps * (to_s - from_s) / (4 * 72) * 12 * 4 * kRunPhotons;
    for (std::size_t side = 0; side < 4; ++side)
      for (std::size_t b = 0; b < kBandCount; ++b) hits[side][b].add(arrived[side][b] / expected);
  }
  for (std::size_t side = 0; side < 4; ++side)
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const Mean& mean = hits[side][b];
      EXPECT_NEAR(mean.value(), 1, 4 * mean.error()) << "side " << side << ", band " << b;
      EXPECT_LT(mean.error(), 0.01) << "side " << side << ", band " << b;
    }
}

}  // namespace
}  // namespace clamor
