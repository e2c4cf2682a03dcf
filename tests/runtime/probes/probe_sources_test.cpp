#include "runtime/probes/probe_sources.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/directivity.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

constexpr double kSpeed_mps = 343;

// On the floor, lit by a probe two metres above it.
Source on_floor(const Vec3f& position_m, const Vec3& probe_m) {
  Source source;
  source.position_m = position_m;
  source.normal = {0, 1, 0};
  const Vec3 arriving = normalize(Vec3(position_m) - probe_m);
  source.mirror = Vec3f(arriving - 2 * arriving.y * Vec3(0, 1, 0));
  source.delay_s = static_cast<float>(length(Vec3(position_m) - probe_m) / kSpeed_mps);
  source.power = same_in_all_bands(1);
  source.emitter = kOnFirstSurface;
  return source;
}

TEST(ProbeSources, MoveAFirstReflectionToTheSourcesOwnPlace) {
  const Vec3 probe_m(0, 2, 0);
  const Source stored = on_floor({1, 0, 0}, probe_m);
  MovingRadiator radiator;
  radiator.position_m = {2, 1, 0.5};
  const Source moved = early_reflection(stored, probe_m, radiator, kSpeed_mps);
  const Vec3 path_m = Vec3(1, 0, 0) - radiator.position_m;
  EXPECT_NEAR(moved.delay_s, length(path_m) / kSpeed_mps, 1e-7);
  const Vec3 arriving = normalize(path_m);
  EXPECT_NEAR(length(Vec3(moved.mirror) - Vec3(arriving.x, -arriving.y, arriving.z)), 0, 1e-6);
  // Irradiance: cosine over the squared distance, cos = height / distance.
  const double ratio = (1 / std::pow(length(path_m), 3)) / (2 / std::pow(std::sqrt(5.0), 3));
  for (const float band : moved.power) EXPECT_NEAR(band, ratio, 1e-5);
}

TEST(ProbeSources, LeaveASourceAtTheProbeAsItIs) {
  const Vec3 probe_m(0, 2, 0);
  MovingRadiator radiator;
  radiator.position_m = probe_m;
  const Source stored = on_floor({1, 0, 0}, probe_m);
  const Source moved = early_reflection(stored, probe_m, radiator, kSpeed_mps);
  EXPECT_NEAR(moved.delay_s, stored.delay_s, 1e-8);
  EXPECT_NEAR(moved.power[3], 1, 1e-6);
  EXPECT_NEAR(length(moved.mirror - stored.mirror), 0, 1e-6);
}

TEST(ProbeSources, LightNoSurfaceFromBehind) {
  const Vec3 probe_m(0, 2, 0);
  MovingRadiator radiator;
  radiator.position_m = {0, -1, 0};
  const Source moved =
      early_reflection(on_floor({1, 0, 0}, probe_m), probe_m, radiator, kSpeed_mps);
  EXPECT_EQ(moved.power, Bands{});
}

TEST(ProbeSources, LengthenLaterPathsByTheirFirstLegAndWeighTheDirectivity) {
  const Vec3 probe_m(0, 1, 0);
  Source stored = on_floor({1, 0, 0}, probe_m);
  stored.delay_s = 0.05f;
  stored.emitter = first_leg_code({{1, 0, 0}, 4});
  MovingRadiator radiator;
  radiator.position_m = {-1, 1, 0};
  radiator.axis = {-1, 0, 0};
  radiator.directivity = same_in_all_bands(2);
  const Source moved = early_reflection(stored, probe_m, radiator, kSpeed_mps);
  // A metre farther from the surface ahead; lengths are stored to 3 %, which cancels.
  EXPECT_NEAR(moved.delay_s, 0.05 + 1 / kSpeed_mps, 1e-5);
  EXPECT_NEAR(moved.power[0], 0, 1e-3);  // leaves backwards
  radiator.axis = {1, 0, 0};
  const Source ahead = early_reflection(stored, probe_m, radiator, kSpeed_mps);
  EXPECT_NEAR(ahead.power[0], 1, 2e-3);
  EXPECT_NEAR(late_reflection(stored, radiator, 7).power[0], 1, 2e-3);
  EXPECT_EQ(late_reflection(stored, radiator, 7).material, 7);
}

// The flux of a point source through a closed surface does not depend on where in it the source is.
TEST(ProbeSources, GiveTheSurfacesOfARoomTheWholePowerOfASourceAnywhereInIt) {
  Level level = testing::shoebox({6, 8, 3}, testing::uniform_material(0.2f), {2, 3, 1.5});
  level.signals = {testing::sine(440)};
  BakeOptions options;
  options.settings.photons = 2000;
  options.settings.sources = 2000;
  options.probe_sources = 20'000;  // all that are early
  options.probes_m = {{3, 4, 1.5}};
  const auto contents = bake(level, options);
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  for (const Vec3& place_m : {Vec3(3, 4, 1.5), Vec3(3.8, 4.6, 1.2), Vec3(2, 3, 1.7)}) {
    MovingRadiator radiator;
    radiator.position_m = place_m;
    double power = 0;
    for (const Source& stored : contents->probes.places[0].tree.sources)
      if (stored.emitter == kOnFirstSurface)
        power += static_cast<double>(
            early_reflection(stored, {3, 4, 1.5}, radiator, kSpeed_mps).power[0]);
    // Two thousand points that the probe spreads evenly, not the source.
    EXPECT_NEAR(power / (emission_power(0) * 0.8), 1, 0.04) << place_m.x;
  }
}

}  // namespace
}  // namespace clamor
