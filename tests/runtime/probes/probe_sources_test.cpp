#include "runtime/probes/probe_sources.h"

#include <cmath>

#include <gtest/gtest.h>

#include "formats/bake_file/first_leg.h"

namespace clamor {
namespace {

constexpr double kSpeedOfSound_mps = 343;

// On the floor, lit by a probe two metres above it.
Source on_floor(const Vec3f& position_m, const Vec3& probe_m) {
  Source source;
  source.position_m = position_m;
  source.normal = {0, 1, 0};
  const Vec3 arriving = normalize(Vec3(position_m) - probe_m);
  source.mirror = Vec3f(arriving - 2 * arriving.y * Vec3(0, 1, 0));
  source.delay_s = static_cast<float>(length(Vec3(position_m) - probe_m) / kSpeedOfSound_mps);
  source.power = same_in_all_bands(1);
  return source;
}

TEST(ProbeSources, MoveAFirstReflectionToTheSourcesOwnPlace) {
  const Vec3 probe_m(0, 2, 0);
  const Source stored = on_floor({1, 0, 0}, probe_m);
  MovingRadiator radiator;
  radiator.position_m = {2, 1, 0.5};
  const Source moved = first_reflection(stored, probe_m, radiator, kSpeedOfSound_mps);
  const Vec3 path_m = Vec3(1, 0, 0) - radiator.position_m;
  EXPECT_NEAR(moved.delay_s, length(path_m) / kSpeedOfSound_mps, 1e-7);
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
  const Source moved = first_reflection(stored, probe_m, radiator, kSpeedOfSound_mps);
  EXPECT_NEAR(moved.delay_s, stored.delay_s, 1e-8);
  EXPECT_NEAR(moved.power[3], 1, 1e-6);
  EXPECT_NEAR(length(moved.mirror - stored.mirror), 0, 1e-6);
}

TEST(ProbeSources, LightNoSurfaceFromBehind) {
  const Vec3 probe_m(0, 2, 0);
  MovingRadiator radiator;
  radiator.position_m = {0, -1, 0};
  const Source moved =
      first_reflection(on_floor({1, 0, 0}, probe_m), probe_m, radiator, kSpeedOfSound_mps);
  EXPECT_EQ(moved.power, Bands{});
}

TEST(ProbeSources, LengthenLaterPathsByTheirFirstLegAndWeighTheDirectivity) {
  const Vec3 probe_m(0, 1, 0);
  Source stored = on_floor({1, 0, 0}, probe_m);
  stored.delay_s = 0.05f;
  stored.path.first_leg = first_leg_code({{1, 0, 0}, 4});
  MovingRadiator radiator;
  radiator.position_m = {-1, 1, 0};
  radiator.axis = {-1, 0, 0};
  radiator.directivity = same_in_all_bands(2);
  const Source moved = early_reflection(stored, probe_m, radiator, kSpeedOfSound_mps);
  // A metre farther from the surface ahead; lengths are stored to 3 %, which cancels.
  EXPECT_NEAR(moved.delay_s, 0.05 + 1 / kSpeedOfSound_mps, 1e-5);
  EXPECT_NEAR(moved.power[0], 0, 1e-3);  // leaves backwards
  radiator.axis = {1, 0, 0};
  const Source ahead = early_reflection(stored, probe_m, radiator, kSpeedOfSound_mps);
  EXPECT_NEAR(ahead.power[0], 1, 2e-3);
  EXPECT_NEAR(late_reflection(stored, radiator, 7).power[0], 1, 2e-3);
  EXPECT_EQ(late_reflection(stored, radiator, 7).material, 7);
}

}  // namespace
}  // namespace clamor
