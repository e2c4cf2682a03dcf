#include "bake/probes/probe_placement.h"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "tests/bake/probes/probe_levels.h"

namespace clamor {
namespace {

using testing::add_box;
using testing::add_quad;
using testing::box;
using testing::count_inside;
using testing::every;
using testing::is_inside;
using testing::level_of;
using testing::named_emitter;
using testing::placed;
using testing::sees_a_probe;
using testing::two_rooms_mesh;

TEST(ProbePlacement, PutsAFewProbesIntoALivingRoomAwayFromItsWalls) {
  const Vec3 size_m(5, 2.6, 4);
  const ProbePlacement placement = placed(level_of(box(size_m), {1, 1, 1}));

  EXPECT_NEAR(placement.spacing_m, 2, 0.4);
  EXPECT_NEAR(placement.floor_m2, 20, 3);
  EXPECT_GE(placement.positions_m.size(), 4u);
  EXPECT_LE(placement.positions_m.size(), 12u);
  for (const Vec3& probe_m : placement.positions_m) {
    EXPECT_TRUE(is_inside(probe_m, Vec3(0.29), size_m - 0.29));
    EXPECT_NEAR(probe_m.y, 1.3, 1e-3);  // half of the free height
  }
}

TEST(ProbePlacement, StaysInsideAClosedRoomAtAnySpacing) {
  const Vec3 size_m(9, 7, 6);
  const Level level = level_of(box(size_m), {1, 1, 1});
  for (const double spacing_m : {0.5, 1.0, 2.0, 5.0, 20.0}) {
    const ProbePlacement placement = placed(level, every(spacing_m));
    EXPECT_GE(placement.positions_m.size(), 2u) << spacing_m;
    EXPECT_EQ(count_inside(placement.positions_m, Vec3(0.1), size_m - 0.1),
              placement.positions_m.size())
        << spacing_m;
  }
}

TEST(ProbePlacement, PutsSparserProbesIntoTheAirOfATallRoom) {
  const ProbePlacement placement = placed(level_of(box({20, 20, 20}), {1, 1, 1}), every(3));

  const std::size_t low = count_inside(placement.positions_m, {0, 0, 0}, {20, 2, 20});
  const std::size_t high = count_inside(placement.positions_m, {0, 10, 0}, {20, 20, 20});
  EXPECT_GT(high, 4u);
  EXPECT_LT(high, low);
}

TEST(ProbePlacement, CoversBothSidesOfADoor) {
  const Level level = level_of(two_rooms_mesh(), {1, 1, 1});
  const ProbePlacement placement = placed(level);

  const Vec3 door_m(6, 1.3, 2.5);
  bool before = false, behind = false;
  for (const Vec3& probe_m : placement.positions_m) {
    if (length(probe_m - door_m) > 1.5) continue;
    before |= probe_m.x < 5.9;
    behind |= probe_m.x > 6.1;
  }
  EXPECT_TRUE(before);
  EXPECT_TRUE(behind);
  EXPECT_GE(count_inside(placement.positions_m, {0, 0, 0}, {6, 3, 5}), 4u);
  EXPECT_GE(count_inside(placement.positions_m, {6, 0, 0}, {12, 3, 5}), 4u);
}

TEST(ProbePlacement, LetsEveryPlaceOfAnLShapedRoomSeeAProbe) {
  Mesh mesh = box({10, 3, 10});
  add_box(mesh, {4, 0, 4}, {10, 3, 10});
  const Level level = level_of(mesh, {1, 1, 1});
  const Scene scene(level.mesh);
  for (const ProbeOptions& options : {ProbeOptions{}, every(1.5), every(4)}) {
    const ProbePlacement placement = placed(level, options);
    for (std::uint32_t i = 0; i < 2000; ++i) {
      const RandomBits bits = philox(7, {i, 0, 0, 0});
      const Vec3 place_m(0.05 + 9.9 * unit(bits[0]), 1.2, 0.05 + 9.9 * unit(bits[1]));
      if (place_m.x > 3.95 && place_m.z > 3.95) continue;
      EXPECT_TRUE(sees_a_probe(scene, place_m, placement.positions_m, 1.5 * placement.spacing_m))
          << place_m.x << " " << place_m.z << ", every " << placement.spacing_m;
    }
  }
}

TEST(ProbePlacement, PutsNoProbeIntoAPillar) {
  Mesh mesh = box({10, 3, 10});
  add_box(mesh, {3.5, 0, 3.5}, {6.5, 3, 6.5});
  for (const Vec3& emitter_m : {Vec3(1, 1, 1), Vec3(8, 1, 8)}) {
    const ProbePlacement placement = placed(level_of(mesh, emitter_m), every(1));
    EXPECT_GT(placement.positions_m.size(), 30u);
    EXPECT_EQ(count_inside(placement.positions_m, {3.5, 0, 3.5}, {6.5, 3, 6.5}), 0u);
  }
}

TEST(ProbePlacement, LeavesOutARoomThatNobodyReaches) {
  Mesh mesh = box({6, 3, 6});
  add_box(mesh, {10, 0, 0}, {16, 3, 6});
  Level level = level_of(mesh, {1, 1, 1});
  EXPECT_EQ(count_inside(placed(level).positions_m, {9, 0, 0}, {17, 3, 6}), 0u);

  level.emitters.push_back(named_emitter("other", {11, 1, 1}));
  EXPECT_GE(count_inside(placed(level).positions_m, {9, 0, 0}, {17, 3, 6}), 4u);
}

TEST(ProbePlacement, SaysSoIfNoPlaceIsReached) {
  Mesh mesh = box({10, 3, 10});
  add_box(mesh, {4.8, 0, 4.8}, {5.2, 3, 5.2});
  const ProbePlacement placement = placed(level_of(mesh, {5, 1, 5}));
  EXPECT_TRUE(placement.positions_m.empty());
  ASSERT_EQ(placement.warnings.size(), 1u);
  EXPECT_TRUE(placement.warnings[0].starts_with("no probe was placed")) << placement.warnings[0];
}

TEST(ProbePlacement, GivesASmallRoomTwoProbesEvenIfTheSpacingIsWide) {
  Mesh mesh = box({20, 5, 20});
  add_box(mesh, {30, 0, 0}, {31.8, 2.2, 1.6});  // 6.3 m3
  Level level = level_of(mesh, {1, 1, 1});
  level.emitters.push_back(named_emitter("cupboard", {31, 1, 1}));

  for (const double spacing_m : {2.0, 6.0})
    EXPECT_GE(count_inside(placed(level, every(spacing_m)).positions_m, {29, 0, 0}, {32, 3, 2}), 2u)
        << spacing_m;
}

TEST(ProbePlacement, FindsEnclosedRoomsIfTheLevelHasNoEmitters) {
  Level level = level_of(box({5, 3, 4}), {1, 1, 1});
  const ProbePlacement with_emitter = placed(level);
  level.emitters.clear();
  EXPECT_EQ(placed(level).positions_m, with_emitter.positions_m);
}

TEST(ProbePlacement, PutsProbesOnGalleriesAndStairs) {
  Mesh mesh = box({12, 8, 12});
  add_quad(mesh, {Vec3f(0, 4, 0), Vec3f(12, 4, 0), Vec3f(12, 4, 3), Vec3f(0, 4, 3)});
  for (int step = 0; step < 20; ++step)  // from the floor to the gallery
    add_box(mesh, {10, 0, 9 - 0.3 * step - 0.3}, {11.5, 0.2 * step + 0.2, 9 - 0.3 * step});
  const ProbePlacement placement = placed(level_of(mesh, {1, 1, 6}), every(2));

  EXPECT_GE(count_inside(placement.positions_m, {0, 5, 0}, {12, 6, 3}), 6u);        // gallery
  EXPECT_GE(count_inside(placement.positions_m, {9.9, 2, 4}, {11.6, 5.5, 9}), 1u);  // stairs
}

TEST(ProbePlacement, StaysWithinTheBoundsOfAnOpenPlane_NoAsan) {
  Mesh mesh;
  add_quad(mesh, {Vec3f(-50, 0, -50), Vec3f(-50, 0, 50), Vec3f(50, 0, 50), Vec3f(50, 0, -50)});
  Level level = level_of(mesh, {0, 1, 0});
  for (const bool has_emitter : {true, false}) {
    if (!has_emitter) level.emitters.clear();
    const ProbePlacement placement = placed(level);
    EXPECT_GE(placement.positions_m.size(), 50u);
    EXPECT_LE(placement.positions_m.size(), 450u);
    for (const Vec3& probe_m : placement.positions_m)
      EXPECT_TRUE(is_inside(probe_m, {-50, 0, -50}, {50, placement.spacing_m + 1e-9, 50}));
  }
}

TEST(ProbePlacement, IsTheSameTwiceAndWithAnotherEmitterInTheRoom) {
  Level level = level_of(two_rooms_mesh(), {1, 1, 1});
  const ProbePlacement once = placed(level), twice = placed(level);
  EXPECT_EQ(once.positions_m, twice.positions_m);

  level.emitters.push_back(named_emitter("other", {10.1, 0.7, 4.2}));
  EXPECT_EQ(placed(level).positions_m, once.positions_m);
}

TEST(ProbePlacement, StaysBelowItsLimitInALargeLevel_NoAsan) {
  const Level level = level_of(box({300, 4, 300}), {1, 1, 1});
  const std::size_t count = placed(level).positions_m.size();
  EXPECT_LE(count, 450u);
  EXPECT_GT(count, 200u);
}

TEST(ProbePlacement, StaysBelowItsLimitWherePillarsHideEverything_NoAsan) {
  Mesh mesh = box({120, 4, 120});
  for (int x = 0; x < 40; ++x)
    for (int z = 0; z < 40; ++z)
      add_box(mesh, {3.0 * x + 0.5, 0, 3.0 * z + 0.5}, {3.0 * x + 2.5, 4, 3.0 * z + 2.5});
  const std::size_t count = placed(level_of(mesh, {3, 1, 3})).positions_m.size();
  EXPECT_LE(count, 450u);
  EXPECT_GT(count, 200u);
}

TEST(ProbePlacement, GoesFromTheStreetThroughADoorIntoAHouse) {
  Mesh mesh;
  add_quad(mesh, {Vec3f(0, 0, 0), Vec3f(0, 0, 60), Vec3f(60, 0, 60), Vec3f(60, 0, 0)});
  const auto wall = [&](const Vec3f& from_m, const Vec3f& to_m) {
    add_quad(mesh,
             {from_m, Vec3f(to_m.x, from_m.y, to_m.z), to_m, Vec3f(from_m.x, to_m.y, from_m.z)});
  };
  wall({20, 0, 20}, {28, 3, 20});
  wall({20, 0, 20}, {20, 3, 26});
  wall({28, 0, 20}, {28, 3, 26});
  wall({20, 0, 26}, {23.5, 3, 26});
  wall({24.5, 0, 26}, {28, 3, 26});
  wall({23.5, 2, 26}, {24.5, 3, 26});
  add_quad(mesh, {Vec3f(20, 3, 20), Vec3f(28, 3, 20), Vec3f(28, 3, 26), Vec3f(20, 3, 26)});
  const ProbePlacement placement = placed(level_of(mesh, {50, 1, 50}));

  EXPECT_GE(count_inside(placement.positions_m, {20, 0, 20}, {28, 3, 26}), 4u);
  EXPECT_GE(count_inside(placement.positions_m, {23, 0, 26}, {25, 3, 27.5}), 1u);  // at the door
  EXPECT_EQ(count_inside(placement.positions_m, {0, -1, 0}, {60, 20, 60}),
            placement.positions_m.size());
}

TEST(ProbePlacement, PlacesNothingInALevelWithoutTriangles) {
  Level level = level_of({}, {1, 1, 1});
  EXPECT_TRUE(placed(level).positions_m.empty());
  EXPECT_TRUE(placed(level).warnings.empty());

  level.probes_m = {{0, 0, 0}};
  EXPECT_TRUE(placed(level).positions_m.empty());
  EXPECT_EQ(placed(level).warnings.size(), 1u);
}

TEST(ProbePlacement, RefusesSpacingsThatAreNoneOrTooSmall) {
  const Level level = level_of(box({5, 3, 4}), {1, 1, 1});
  const Scene scene(level.mesh);
  for (const double spacing_m :
       {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity(), 1e-9, 1e-300, 0.001})
    EXPECT_FALSE(place_probes(scene, level, every(spacing_m)).ok()) << spacing_m;
  const auto narrow = place_probes(scene, level, every(0.001));
  EXPECT_NE(narrow.error().message.find("20000"), std::string::npos) << narrow.error().message;
}

TEST(ProbePlacement, PlacesAFewProbesWithAnEnormousSpacing) {
  const std::size_t count =
      placed(level_of(box({5, 3, 4}), {1, 1, 1}), every(1e9)).positions_m.size();
  EXPECT_GE(count, 2u);
  EXPECT_LE(count, 12u);
}

}  // namespace
}  // namespace clamor
