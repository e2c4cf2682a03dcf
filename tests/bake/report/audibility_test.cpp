// Tests of emitters and listeners that nobody hears, and of what users read about them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bake/report/audibility_messages.h"
#include "bake/report/level_report.h"
#include "tests/bake/mesh/mesh_shapes.h"
#include "tests/bake/report/open_box.h"

namespace clamor {
namespace {

using ::testing::AllOf;
using testing::box;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kCeiling;
using testing::kFloor;
using testing::kFront;
using testing::kLeft;
using ::testing::Not;
using testing::shoebox;
using testing::uniform_material;
using testing::Wall;
using testing::without;

// A box whose triangles face outwards or inwards.
Mesh box_between(const Vec3& low_m, const Vec3& high_m, bool outwards) {
  Mesh mesh = box(high_m - low_m);
  for (Vec3f& vertex : mesh.vertices_m) vertex += Vec3f(low_m);
  if (outwards)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

const Vec3 kHall_m(8, 3, 6), kPillar_m(4, 1.2, 3);

// A hall with a pillar of square section from floor to ceiling, 0.37 m thick by default.
Level hall_with_pillar(const Vec3& emitter_m, bool outwards = true, double thick_m = 0.37) {
  Level level = shoebox(kHall_m, uniform_material(0.1f), emitter_m);
  testing::add(level.mesh, box_between({4 - thick_m / 2, 0, 3 - thick_m / 2},
                                       {4 + thick_m / 2, 3, 3 + thick_m / 2}, outwards));
  return level;
}

std::vector<InaudibleEmitter> unheard_in(const Level& level) {
  const Scene scene(level.mesh, Scene::Build::kQuick);
  return Audibility(scene, level.mesh, level.materials).inaudible(level.emitters);
}

std::optional<InaudiblePlace> inaudible_at(const Level& level, const Vec3& listener_m) {
  const Scene scene(level.mesh, Scene::Build::kQuick);
  return Audibility(scene, level.mesh, level.materials)
      .inaudible_at(std::span(&listener_m, 1), level.emitters, level.air)[0];
}

TEST(LevelReport, WarnsOfAnEmitterInAPillarAndNamesAnAudiblePlace) {
  for (const bool outwards : {true, false}) {
    Level level = hall_with_pillar(kPillar_m, outwards);
    const auto unheard = unheard_in(level);
    ASSERT_EQ(unheard.size(), 1u);
    EXPECT_EQ(unheard[0].place.why, InaudibleCause::kInSolid);
    EXPECT_NEAR(unheard[0].place.width_m, 0.37, 0.15);
    ASSERT_TRUE(unheard[0].place.alternative_m.has_value());
    EXPECT_LT(length(*unheard[0].place.alternative_m - kPillar_m), 1);
    EXPECT_THAT(report_warnings(prepare_level(level)),
                Contains(HasSubstr("emitter 'source' lies inside a solid")));
    Level moved = hall_with_pillar(*unheard[0].place.alternative_m, outwards);
    EXPECT_THAT(report_warnings(prepare_level(moved)), IsEmpty());
  }
  // Larger than the limit for cavities, but seen from behind within a room.
  const auto thick = unheard_in(hall_with_pillar(kPillar_m, true, 1.5));
  ASSERT_EQ(thick.size(), 1u);
  EXPECT_EQ(thick[0].place.why, InaudibleCause::kInSolid);
  // Also without a ceiling, and in a long wall.
  Level open = without(kCeiling, kHall_m, 0.1f, kPillar_m);
  testing::add(open.mesh, box_between({3.6, 0, 2.6}, {4.4, 2.5, 3.4}, true));
  EXPECT_EQ(unheard_in(open).size(), 1u);
  Level wall = shoebox(kHall_m, uniform_material(0.1f), {3, 1.2, 5.2});
  testing::add(wall.mesh, box_between({0.01, 0.01, 4.8}, {7.99, 2.99, 5.5}, true));
  EXPECT_EQ(unheard_in(wall).size(), 1u);
}

TEST(LevelReport, WarnsOfAnEmitterOutsideAClosedLevel) {
  for (const Vec3& emitter_m : {Vec3(48, 1.5, 3), Vec3(4, 1.5, -0.1), Vec3(4, 3.5, 3)}) {
    Level level = hall_with_pillar(emitter_m);
    const auto unheard = unheard_in(level);
    ASSERT_EQ(unheard.size(), 1u);
    EXPECT_EQ(unheard[0].place.why, InaudibleCause::kOutside);
    ASSERT_TRUE(unheard[0].place.alternative_m.has_value());
    EXPECT_TRUE(unheard_in(hall_with_pillar(*unheard[0].place.alternative_m)).empty());
    const LevelReport report = prepare_level(level);
    EXPECT_THAT(report_warnings(report), Contains(HasSubstr("'source' lies outside the level")));
    EXPECT_THAT(report_lines(report), Not(Contains(HasSubstr("in the open"))));
  }
}

TEST(LevelReport, WarnsOfAnEmitterOnAWall) {
  Level level = hall_with_pillar({1, 0, 1});
  const LevelReport report = prepare_level(level);
  EXPECT_THAT(report_warnings(report),
              Contains(AllOf(HasSubstr("'source' lies on a surface"), HasSubstr("1,0.02,1"))));
  EXPECT_THAT(report_lines(report), Contains(HasSubstr("closed: none of")));
  // An emitter on a table is audible above and below it.
  Level table = hall_with_pillar({1, 1, 1});
  testing::add_quad(table.mesh, {Vec3f(0.5f, 1, 0.5f), Vec3f(0.5f, 1, 1.5f), Vec3f(1.5f, 1, 1.5f),
                                 Vec3f(1.5f, 1, 0.5f)});
  EXPECT_THAT(report_warnings(prepare_level(table)), IsEmpty());
}

TEST(LevelReport, NamesTheFirstOfManyMisplacedEmittersAndCountsTheOthers) {
  Level level = hall_with_pillar(kPillar_m);
  level.emitters.resize(6, level.emitters[0]);
  for (std::size_t i = 0; i < 6; ++i) {
    level.emitters[i].name = "e" + std::to_string(i);
    level.emitters[i].delay_s = static_cast<double>(i);  // else they would be one emitter
  }
  level.emitters[0].position_m = {1, 1, 1};
  const auto warnings = report_warnings(prepare_level(level));
  ASSERT_EQ(warnings.size(), 4u);
  EXPECT_THAT(warnings[0], HasSubstr("emitter 'e1' lies inside a solid"));
  EXPECT_THAT(warnings[3], HasSubstr("2 more emitters"));
}

TEST(LevelReport, AcceptsAudibleEmitters) {
  const auto expect_none = [](Level level, const char* what) {
    EXPECT_TRUE(unheard_in(level).empty()) << what;
  };
  expect_none(hall_with_pillar({3.78, 1.2, 3}), "3 cm from a pillar");
  expect_none(hall_with_pillar({1, 0.01, 1}), "just off the floor");
  for (const Wall wall : {kLeft, kFloor, kCeiling, kFront}) {
    expect_none(without(wall, kHall_m, 0.1f, {2, 1, 2}), "a wall is missing");
    expect_none(without(wall, kHall_m, 0.1f, {2, 20, 2}), "above a level that is open");
  }

  Level outwards = shoebox({5, 4, 3}, uniform_material(0.1f), {1, 1, 1});
  outwards.mesh = box_between({0, 0, 0}, {5, 4, 3}, true);
  expect_none(outwards, "walls that face outwards");
  // Such a room on a wide plain, and six of them in a row.
  testing::add_quad(outwards.mesh, {Vec3f(-500, 0, -500), Vec3f(-500, 0, 500), Vec3f(500, 0, 500),
                                    Vec3f(500, 0, -500)});
  expect_none(outwards, "a room on a plain");
  for (int i = 1; i < 6; ++i)
    testing::add(outwards.mesh, box_between({5.2 * i, 0, 0}, {5.2 * i + 5, 4, 3}, true));
  expect_none(outwards, "one room of six");

  // A narrow level that faces outwards throughout.
  Level duct = shoebox({20, 0.9, 0.9}, uniform_material(0.1f), {3, 0.4, 0.4});
  duct.mesh = box_between({0, 0, 0}, {20, 0.9, 0.9}, true);
  expect_none(duct, "a duct");

  // A closed booth in a hall is a room of its own, because its walls face inwards.
  Level booth = shoebox(kHall_m, uniform_material(0.1f), {2, 1, 2});
  testing::add(booth.mesh, box_between({1, 0, 1}, {3, 2.2, 3}, false));
  expect_none(booth, "a booth");
  // Sound behind a transmitting wall is heard inside.
  Level thin = hall_with_pillar({48, 1.5, 3});
  thin.materials[0].transmission = same_in_all_bands(0.05f);
  expect_none(thin, "walls that let sound through");
}

TEST(LevelReport, WarnsBehindMassiveWallsAlthoughTheyTransmit) {
  // Brick has a sound reduction index of 32 dB at 125 Hz.
  Level outside = hall_with_pillar({48, 1.5, 3});
  outside.materials[0].transmission = same_in_all_bands(6e-4f);
  EXPECT_EQ(unheard_in(outside).size(), 1u);
  // A prop of wood: 14 dB at 63 Hz, above 25 dB from 500 Hz.
  Level prop = hall_with_pillar(kPillar_m);
  prop.materials[0].transmission = {0.04f, 0.02f, 0.016f, 0.003f, 0.001f, 0.002f, 6e-4f, 2e-4f};
  EXPECT_EQ(unheard_in(prop).size(), 1u);
}

TEST(Audibility, NamesTheCauseOfSilenceAndAnAudiblePlace) {
  const Level hall = hall_with_pillar({1, 1, 1});
  const struct {
    Vec3 listener_m;
    InaudibleCause why;
  } kCases[] = {{kPillar_m, InaudibleCause::kInSolid},
                {{48, 1.5, 3}, InaudibleCause::kOutside},
                {{4, 1.5, 6.2}, InaudibleCause::kOutside},
                {{2, 0, 2}, InaudibleCause::kOnSurface},
                {{1e9, 0, 0}, InaudibleCause::kFarAway}};
  for (const auto& [listener_m, why] : kCases) {
    const auto found = inaudible_at(hall, listener_m);
    ASSERT_TRUE(found.has_value()) << listener_m.x;
    EXPECT_EQ(found->why, why) << listener_m.x;
    ASSERT_TRUE(found->alternative_m.has_value()) << listener_m.x;
    EXPECT_FALSE(inaudible_at(hall, *found->alternative_m).has_value()) << listener_m.x;
  }
  for (const Vec3& fine_m : {Vec3(7, 1, 5), Vec3(4.25, 1.2, 3), Vec3(0.03, 0.03, 0.03)})
    EXPECT_FALSE(inaudible_at(hall, fine_m).has_value());
}

TEST(Audibility, BlamesAMisplacedEmitterRatherThanTheListener) {
  const Level level = hall_with_pillar(kPillar_m);
  const auto found = inaudible_at(level, {1, 1, 1});
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->emitter, 0u);
  const std::string text = in_words(*found, {1, 1, 1}, level.emitters);
  EXPECT_THAT(text,
              HasSubstr("hardly anything is heard at 1,1,1: emitter 'source' lies inside a solid"));
}

TEST(Audibility, FollowsSoundThroughDoorsAndTransmittingWallsOnly) {
  // Two rooms, separated by a wall with or without a slit.
  const auto rooms = [](double slit_m) {
    Level level = shoebox(kHall_m, uniform_material(0.1f), {1, 1, 1});
    testing::add_quad(level.mesh,
                      {Vec3f(5, slit_m, 0), Vec3f(5, 3, 0), Vec3f(5, 3, 6), Vec3f(5, slit_m, 6)});
    return level;
  };
  const Vec3 listener_m(7, 1, 5);
  EXPECT_FALSE(inaudible_at(rooms(0.1), listener_m).has_value());
  Level closed = rooms(0);
  const auto found = inaudible_at(closed, listener_m);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->why, InaudibleCause::kShutOff);
  closed.materials[0].transmission = same_in_all_bands(0.05f);
  EXPECT_FALSE(inaudible_at(closed, listener_m).has_value());
}

TEST(Audibility, AcceptsDiffractionAroundAWallInTheOpen) {
  Level level = shoebox({5, 4, 3}, uniform_material(0.1f), {0, 1.5, 2});
  level.mesh = {};
  testing::add_quad(level.mesh, {Vec3f(-2, 0, 0), Vec3f(2, 0, 0), Vec3f(2, 3, 0), Vec3f(-2, 3, 0)});
  EXPECT_FALSE(inaudible_at(level, {0, 1.5, -2}).has_value());
}

TEST(Audibility, EndsAtAGreatDistanceInAFreeField) {
  Level field = shoebox({5, 4, 3}, uniform_material(0.1f), {1, 1, 1});
  field.mesh = {};
  EXPECT_FALSE(inaudible_at(field, {100, 1, 1}).has_value());
  const auto found = inaudible_at(field, {1e9, 1, 1});
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->why, InaudibleCause::kFarAway);
  EXPECT_FALSE(inaudible_at(field, *found->alternative_m).has_value());
}

}  // namespace
}  // namespace clamor
