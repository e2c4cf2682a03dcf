#include "runtime/probes/first_reflection_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "common/directivity.h"
#include "common/sphere.h"
#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/propagation/radiation_model.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

constexpr Air kAir{};
constexpr double kAbsorption = 0.2;
const Vec3 kPlace_m(2, 3, 1);

std::vector<FirstReflection> all_of(const FirstReflectionTracer& tracer, const Vec3& place_m,
                                    std::uint64_t key = 1, const Vec3& listener_m = Vec3(1e6)) {
  std::vector<FirstReflection> all;
  for (std::uint32_t set = 0; set < FirstReflectionTracer::kSets; ++set)
    tracer.trace(place_m, listener_m, key, set, all);
  return all;
}

// The lowest band, in which the air takes nothing.
double power_of(const std::vector<FirstReflection>& reflections) {
  double sum = 0;
  for (const FirstReflection& one : reflections) sum += static_cast<double>(one.source.power[0]);
  return sum;
}

// Every ray meets a wall of a closed room, which keeps the power but for what it absorbs.
TEST(FirstReflectionTracer, GivesTheSurfacesOfARoomTheWholePowerOfASource) {
  const std::array materials = {testing::uniform_material(kAbsorption)};
  const Mesh mesh = testing::box({6, 8, 3});
  const OcclusionGeometry surfaces(mesh, materials);
  const FirstReflectionTracer tracer(surfaces, materials, kAir, {});
  for (const Vec3& place_m : {kPlace_m, Vec3(5.9, 0.1, 2.9), Vec3(3, 4, 1.5)}) {
    const auto all = all_of(tracer, place_m);
    EXPECT_EQ(all.size(), FirstReflectionTracer::kRays);
    EXPECT_NEAR(power_of(all) / (emission_power(0) * (1 - kAbsorption)), 1, 1e-3);
  }
  std::set<std::uint32_t> numbers;
  for (const FirstReflection& one : all_of(tracer, kPlace_m)) numbers.insert(one.number);
  EXPECT_EQ(numbers.size(), FirstReflectionTracer::kRays);
  EXPECT_LT(*numbers.rbegin(), FirstReflectionTracer::kNumbers);
}

// A wall gets the share of the power that it covers of the sphere: 4 pi / 6 in the middle of a
// cube.
TEST(FirstReflectionTracer, GivesEachWallItsSolidAngle) {
  const std::array materials = {testing::uniform_material(0)};
  const Mesh mesh = testing::box({4, 4, 4});
  const OcclusionGeometry surfaces(mesh, materials);
  const FirstReflectionTracer tracer(surfaces, materials, kAir, {});
  double floor = 0;
  constexpr std::uint64_t kSources = 50;
  for (std::uint64_t key = 0; key < kSources; ++key)
    for (const FirstReflection& one : all_of(tracer, {2, 2, 2}, key))
      if (one.source.position_m.y < 1e-3f) floor += static_cast<double>(one.source.power[0]);
  // The floor gets a sixth of 12 600 directions; if they were independent, that would be known to 2
  // %.
  EXPECT_NEAR(floor / static_cast<double>(kSources) / (emission_power(0) / 6), 1, 0.03);
}

// The best arrangement of 42 points leaves no direction farther from one than some 22 degrees.
TEST(FirstReflectionTracer, CoversTheSphereEvenlyWithEachSet) {
  const std::array materials = {testing::uniform_material(0)};
  const Mesh mesh = testing::box({4, 4, 4});
  const OcclusionGeometry surfaces(mesh, materials);
  const FirstReflectionTracer tracer(surfaces, materials, kAir, {});
  for (std::uint32_t set = 0; set < FirstReflectionTracer::kSets; ++set) {
    std::vector<FirstReflection> of_set;
    tracer.trace({2, 2, 2}, Vec3(1e6), 1, set, of_set);
    double widest = 0;
    for (std::uint32_t i = 0; i < 1000; ++i) {
      double nearest = 4;
      for (const FirstReflection& one : of_set)
        nearest = std::min(
            nearest,
            std::acos(std::min(1.0, dot(spread_direction(i, 1000),
                                        normalize(Vec3(one.source.position_m) - Vec3(2))))));
      widest = std::max(widest, nearest);
    }
    EXPECT_LT(widest, 32 * std::numbers::pi / 180) << set;
  }
}

TEST(FirstReflectionTracer, PutsReflectionsOntoTheSideThatSoundLeavesFrom) {
  std::array materials = {testing::uniform_material(0.5f)};
  materials[0].transmission = same_in_all_bands(0.1f);
  const Mesh mesh = testing::box({6, 8, 3});
  const OcclusionGeometry surfaces(mesh, materials);
  const FirstReflectionTracer tracer(surfaces, materials, kAir, {});
  const auto all = all_of(tracer, kPlace_m);
  EXPECT_EQ(all.size(), 2 * FirstReflectionTracer::kRays);
  EXPECT_NEAR(power_of(all) / (emission_power(0) * 0.6), 1, 1e-3);
  for (const FirstReflection& one : all) {
    const Source& source = one.source;
    const Vec3 path_m = Vec3(source.position_m) - kPlace_m, arriving = normalize(path_m);
    EXPECT_NEAR(static_cast<double>(source.delay_s), length(path_m) / speed_of_sound_mps(kAir),
                1e-6);
    const bool is_transmitted = one.number % 2 == 1;
    EXPECT_EQ(dot(arriving, Vec3(source.normal)) > 0, is_transmitted);
    // The law of reflection: the mirror direction has the angle of incidence, on the other side.
    EXPECT_NEAR(dot(Vec3(source.mirror), Vec3(source.normal)),
                std::abs(dot(arriving, Vec3(source.normal))), 1e-5);
    EXPECT_NEAR(static_cast<double>(length(source.mirror)), 1, 1e-5);
    // The area pi D^2 = 2 pi R^2 of the patch is the ray's share of the sphere, seen aslant.
    const double area_m2 =
        2 * std::numbers::pi * static_cast<double>(source.patch_radius_m * source.patch_radius_m);
    const double cos_i = std::max(std::abs(dot(arriving, Vec3(source.normal))), 0.05);
    EXPECT_NEAR(area_m2 * cos_i / dot(path_m, path_m),
                4 * std::numbers::pi / FirstReflectionTracer::kRays, 1e-4);
  }
}

TEST(FirstReflectionTracer, LosesWhatGoesIntoTheOpenOrMeetsAPart) {
  const std::array materials = {testing::uniform_material(0)};
  Mesh floor;
  testing::add_quad(floor, {{{-500, 0, -500}, {-500, 0, 500}, {500, 0, 500}, {500, 0, -500}}});
  OcclusionGeometry surfaces(floor, materials);
  const FirstReflectionTracer tracer(surfaces, materials, kAir, {});
  const double of_floor = power_of(all_of(tracer, {0, 2, 0}));
  EXPECT_NEAR(of_floor / (emission_power(0) / 2), 1, 0.04);  // the lower half, of 64 rays

  // A slab under the source, from which it sees half of the floor's solid angle.
  MovingParts parts;
  const auto slab = PartShape::make(testing::box({2, 0.1, 2}), materials);
  ASSERT_TRUE(slab.ok());
  ASSERT_TRUE(parts.add(*slab, {.position_m = {-1, 1.42, -1}}).ok());
  PartScene scene;
  scene.update(parts);
  surfaces.set_parts(&scene);
  // A square of half-width a seen from the height h above it covers 4 asin(a^2 / (a^2 + h^2)).
  const double h2 = 0.48 * 0.48, covered = 4 * std::asin(1 / (1 + h2));
  EXPECT_NEAR(power_of(all_of(tracer, {0, 2, 0})), of_floor - covered, 0.3);
  EXPECT_LT(power_of(all_of(tracer, {0, 2, 0})), of_floor - 2);
}

// Closed form: above a Lambertian plane that a source at the height h lights, E = h / (pi r^3) per
// unit of its intensity, and the reflected intensity at a point at the height z above it is that of
// all of the plane; the sum over a fine grid serves as the oracle.
TEST(FirstReflectionTracer, IsAsTrueForAListenerNearASurfaceAsElsewhere_NoAsan) {
  const std::array materials = {testing::uniform_material(0)};
  Mesh floor;
  testing::add_quad(floor, {{{-400, 0, -400}, {-400, 0, 400}, {400, 0, 400}, {400, 0, -400}}});
  const OcclusionGeometry surfaces(floor, materials);
  const FirstReflectionTracer tracer(surfaces, materials, kAir, {});
  const std::vector<Emitter> emitters(1);
  const RadiationModel radiation(emitters, materials, kAir);
  const Vec3 source_m(0, 10, 0);
  for (const Vec3& listener_m : {Vec3(12, 0.5, 0), Vec3(5, 2, 3)}) {
    double expected = 0;
    constexpr double kCell_m = 0.05;
    for (int i = -1200; i < 1200; ++i)
      for (int j = -1200; j < 1200; ++j) {
        const Vec3 at_m = Vec3(listener_m.x, 0, listener_m.z) + kCell_m * Vec3(i + 0.5, 0, j + 0.5);
        const double r_m = length(at_m - source_m), l_m = length(at_m - listener_m);
        expected += kCell_m * kCell_m * source_m.y / (r_m * r_m * r_m) * listener_m.y /
                    (std::numbers::pi * l_m * l_m * l_m);
      }
    double sum = 0;
    constexpr std::uint64_t kDraws = 40;
    for (std::uint64_t key = 0; key < kDraws; ++key)
      for (const FirstReflection& one : all_of(tracer, source_m, key, listener_m))
        sum += static_cast<double>(radiation.intensity(one.source, listener_m)[0]);
    EXPECT_NEAR(sum / static_cast<double>(kDraws) / expected, 1, 0.05) << listener_m.y;
  }
}

TEST(FirstReflectionTracer, NotesThePortalsThatARayPasses) {
  const std::array materials = {testing::uniform_material(0)};
  const Mesh mesh = testing::box({6, 8, 3});
  const OcclusionGeometry surfaces(mesh, materials);
  const std::array portals = {
      Portal{"curtain", {4, 4, 1.5}, {0, 4, 0}, {0, 0, 1.5}, false}};  // across the room
  const FirstReflectionTracer tracer(surfaces, materials, kAir, portals);
  std::size_t beyond = 0;
  for (const FirstReflection& one : all_of(tracer, kPlace_m)) {
    EXPECT_EQ(!one.portals.is_empty(), one.source.position_m.x > 4);
    beyond += one.portals.is_empty() ? 0 : 1;
  }
  EXPECT_GT(beyond, 10u);
}

}  // namespace
}  // namespace clamor
