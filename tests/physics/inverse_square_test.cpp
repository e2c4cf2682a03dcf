// The inverse-square law, for direct sound from an emitter and for power carried by photons.
#include <cmath>
#include <numbers>
#include <optional>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "bake/trace/photon_tracer.h"
#include "common/air.h"
#include "runtime/response/energy_response.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

TEST(InverseSquare, HoldsForABakeInTheFreeField) {
  Level level = testing::shoebox({1, 1, 1}, testing::uniform_material(0), {1, 2, 3});
  level.mesh = {};
  level.emitters[0].gain = 0.5;
  const auto contents = bake(level, {});
  ASSERT_TRUE(contents.ok());
  const Bands loss_per_m = air_loss_per_m(level.air);
  for (const double r_m : {0.5, 1.0, 2.0, 4.0, 64.0}) {
    const auto arrivals =
        energy_response(contents->octree.sources, contents->emitters, contents->materials,
                        level.air, Vec3(1, 2, 3) + r_m * Vec3(0.48, 0.6, -0.64), std::nullopt);
    ASSERT_EQ(arrivals.size(), 1u);
    EXPECT_NEAR(arrivals[0].time_s, r_m / speed_of_sound_mps(level.air), 1e-9);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double left = std::exp(-static_cast<double>(loss_per_m[b]) * r_m);
      EXPECT_NEAR(arrivals[0].energy[b] / (0.25 / (r_m * r_m) * left), 1, 1e-5) << r_m << " m";
    }
  }
}

TEST(InverseSquare, HoldsForPhotonsHittingAPlate) {
  constexpr std::uint64_t kPhotons = 256 * kRunPhotons;
  for (const double r_m : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    Level level = testing::shoebox({1, 1, 1}, testing::uniform_material(0), {0.5, 0.5, -r_m});
    level.mesh.triangles = {level.mesh.triangles[8], level.mesh.triangles[9]};  // z = 0
    level.mesh.materials.resize(2);
    const Scene scene(level.mesh);
    const PhotonTracer tracer(scene, level, {.roulette_exponent = 0, .max_bounces = 1});
    double caught = 0;
    for (std::uint64_t first = 0; first < kPhotons; first += kRunPhotons) {
      const PhotonRun run{0, first, kRunPhotons};
      TracedRuns traced;
      tracer.trace({&run, 1}, traced);
      for (const Deposit& deposit : traced.deposits())
        caught += static_cast<double>(deposit.power[2]) / kPhotons;
    }
    // Solid angle of a square of side 1, times the emitter's intensity of 1 at 1 m.
    const double expected = 4 * std::atan(1 / (4 * r_m * std::sqrt(r_m * r_m + 0.5)));
    // Standard deviation of random numbers; Sobol points have less.
    const double spread = expected / std::sqrt(kPhotons * expected / (4 * std::numbers::pi));
    EXPECT_NEAR(caught, expected, 3 * spread) << r_m << " m";
    EXPECT_LT(spread, 0.07 * expected);
  }
}

}  // namespace
}  // namespace clamor
