// Tests of what the report tells a designer before the bake.
#include "bake/report/level_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bake/report/audibility.h"
#include "bake/trace/photon_tracer.h"
#include "tests/bake/mesh/mesh_shapes.h"

namespace clamor {
namespace {

using ::testing::AllOf;
using testing::box;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::shoebox;
using testing::uniform_material;

enum Wall { kLeft, kRight, kFloor, kCeiling, kBack, kFront };

// A shoebox without one of its walls.
Level without(Wall wall, const Vec3& size_m, float absorption, const Vec3& emitter_m) {
  Level level = shoebox(size_m, uniform_material(absorption), emitter_m);
  level.mesh.triangles.erase(level.mesh.triangles.begin() + 2 * wall,
                             level.mesh.triangles.begin() + 2 * wall + 2);
  level.mesh.materials.resize(10);
  return level;
}

TEST(LevelReport, CallsABoxClosedAndKnowsItsVolumeAndMeanFreePath) {
  Level level = shoebox({6, 4, 3}, uniform_material(0.1f), {1, 1, 1});
  const LevelReport report = prepare_level(level);
  EXPECT_EQ(report.openings.escaped, 0u);
  EXPECT_GT(report.openings.rays, 10'000u);
  EXPECT_NEAR(report.volume_m3, 72, 1e-9);
  EXPECT_NEAR(report.area_m2, 108, 1e-9);
  // Mean chord of a diffuse field (Kosten). The walks start at the emitter, not in equilibrium.
  EXPECT_NEAR(report.geometric_free_path_m().value_or(0), 4 * 72.0 / 108, 1e-9);
  EXPECT_NEAR(report.openings.mean_free_path_m, 4 * 72.0 / 108, 0.02 * 4 * 72 / 108);
  EXPECT_THAT(report_lines(report), Contains(HasSubstr("closed: none of")));
  EXPECT_THAT(report_warnings(report), IsEmpty());
}

TEST(LevelReport, OfBlackWallsLosesThroughAMissingOneWhatIsSeenOfIt) {
  // From the centre of a cube each side covers a sixth of all directions. Four standard deviations
  // for 2048 rays.
  const double bound = 4 * std::sqrt(1.0 / 6 * 5 / 6 / 2048);
  for (const Wall wall : {kLeft, kFloor, kCeiling, kFront}) {
    Level level = without(wall, {4, 4, 4}, 1, {2, 2, 2});
    EXPECT_NEAR(prepare_level(level).openings.escaped_share, 1.0 / 6, bound);
  }
}

TEST(LevelReport, LosesWhatTheBakeLoses) {
  Level level = without(kCeiling, {6, 4, 3}, 0.3f, {2, 1, 1});
  const double share = prepare_level(level).openings.escaped_share;
  TraceSettings settings;
  const Scene scene(level.mesh);
  const PhotonTracer tracer(scene, level, settings);
  const std::vector<PhotonRun> runs = {
      {0, 0, 1024}, {0, 1024, 1024}, {0, 2048, 1024}, {0, 3072, 1024}};
  TracedRuns traced;
  tracer.trace(runs, traced);
  double escaped = 0, emitted = 0;
  for (const TracedRun& run : traced.runs()) escaped += run.tally.power_escaped[3];
  emitted = tracer.power_emitted()[3] * 4096;
  EXPECT_NEAR(share, escaped / emitted, 0.03 * share);
}

TEST(LevelReport, SaysWhereSoundLeaves) {
  Level roofless = without(kCeiling, {6, 4, 3}, 0.1f, {2, 1, 1});
  const LevelReport up = prepare_level(roofless);
  ASSERT_EQ(up.openings.openings.size(), 1u);
  const LevelOpening& sky = up.openings.openings[0];
  EXPECT_LT(length(sky.place_m - Vec3(3, 4, 1.5)), 0.4);
  EXPECT_GT(sky.direction.y, 0.5);
  EXPECT_NEAR(sky.edge_length_m, 18, 1e-5);
  EXPECT_THAT(report_lines(up), Contains(HasSubstr("open sky?")));
  EXPECT_THAT(report_warnings(up), IsEmpty());  // an open ceiling is common

  Level bottomless = without(kFloor, {6, 4, 3}, 0.1f, {2, 1, 1});
  EXPECT_THAT(report_warnings(prepare_level(bottomless)), Contains(HasSubstr("floor missing?")));
}

TEST(LevelReport, NamesTwoOpeningsApart) {
  // A long hall, open at both ends.
  Level level = without(kLeft, {30, 3, 4}, 0.1f, {15, 1.5, 2});
  level.mesh.triangles.erase(level.mesh.triangles.begin(), level.mesh.triangles.begin() + 2);
  level.mesh.materials.resize(8);
  const LevelReport report = prepare_level(level);
  ASSERT_EQ(report.openings.openings.size(), 2u);
  for (const LevelOpening& opening : report.openings.openings) {
    const Vec3 end(opening.direction.x > 0 ? 30 : 0, 1.5, 2);
    EXPECT_LT(length(opening.place_m - end), 1.5);
  }
}

TEST(LevelReport, FindsASlitUnderADoorAndNoneUnderAWallThatStands) {
  const auto with_wall = [](double above_m) {
    Level level = shoebox({6, 3, 4}, uniform_material(0.1f), {1, 1, 1});
    testing::add(level.mesh, testing::patch(3, 2, [above_m](double u, double v) {
                   return Vec3(3, above_m + v * (3 - above_m), 4 * u);
                 }));
    return level;
  };
  Level door = with_wall(0.008), wall = with_wall(0);
  const LevelReport gap = prepare_level(door);
  ASSERT_EQ(gap.gaps.size(), 1u);
  EXPECT_NEAR(gap.gaps[0].width_m, 0.008, 1e-6);
  EXPECT_NEAR(gap.gaps[0].length_m, 4, 1e-6);
  EXPECT_NEAR(gap.gaps[0].place_m.x, 3, 1e-6);
  EXPECT_THAT(report_lines(gap), Contains(HasSubstr("8.0 mm wide over 4.0 m")));
  const LevelReport none = prepare_level(wall);
  EXPECT_TRUE(none.gaps.empty());
  EXPECT_NEAR(none.resting_edges_m, 4 + 4 + 3 + 3, 1e-6);
  EXPECT_EQ(none.free_edges_m, 0);
}

TEST(LevelReport, WarnsOfFacesThatAreThereTwiceInTwoMaterials) {
  Level level = shoebox({5, 4, 3}, uniform_material(0.1f), {1, 1, 1});
  level.materials.push_back(uniform_material(0.9f));
  level.materials[0].name = "brick";
  level.materials[1].name = "felt";
  Mesh twice = box({5, 4, 3}, {1, 1, 1, 1, 1, 1});
  twice.triangles.resize(2);
  twice.materials.resize(2);
  testing::add(level.mesh, twice);
  const LevelReport report = prepare_level(level);
  EXPECT_EQ(report.duplicated, 2u);
  EXPECT_NEAR(report.duplicated_m2, 12, 1e-9);
  EXPECT_THAT(report_warnings(report),
              Contains(HasSubstr("12.00 m2 are there twice, in 'brick' and in 'felt'")));
  EXPECT_NEAR(report.materials[0].area_m2, 94, 1e-9);
  EXPECT_NEAR(report.materials[1].area_m2, 0, 1e-9);
  EXPECT_NEAR(report.materials[1].read_m2, 12, 1e-9);
}

TEST(LevelReport, AsksAfterTheUnitOfTinyAndOfHugeLevels) {
  Level tiny = shoebox({0.05, 0.04, 0.03}, uniform_material(0.1f), {0.01, 0.01, 0.01});
  EXPECT_THAT(report_warnings(prepare_level(tiny)), Contains(HasSubstr("another unit?")));
  Level huge = shoebox({500, 400, 300}, uniform_material(0.1f), {10, 10, 10});
  EXPECT_THAT(report_warnings(prepare_level(huge)), Contains(HasSubstr("another unit?")));
}

TEST(LevelReport, TellsWhatSimplificationSavedAndWhatItDidToTheAreas) {
  Level level = shoebox({5, 4, 3}, uniform_material(0.1f), {2, 2, 0.01});
  level.materials.assign(6, level.materials[0]);
  level.mesh = testing::fine_box({5, 4, 3}, 10);
  const LevelReport report = prepare_level(level, {0.05});
  ASSERT_TRUE(report.simplification.has_value());
  EXPECT_EQ(report.simplification->triangles_before, 1200u);
  EXPECT_EQ(report.simplification->triangles_after, 12u);
  EXPECT_EQ(level.mesh.triangles.size(), 12u);
  EXPECT_NEAR(report.simplification->area_after_m2, 94, 1e-4);
  EXPECT_THAT(report_lines(report),
              Contains(HasSubstr("12 triangles instead of 1200, area +0.00 %")));
  // The emitter is 1 cm from a wall that may have moved by 5 cm.
  EXPECT_THAT(report_warnings(report), Contains(HasSubstr("'source' is 1 cm away")));
}

TEST(LevelReport, OfALevelWithoutTrianglesIsEmpty) {
  Level level = shoebox({5, 4, 3}, uniform_material(0.1f), {1, 1, 1});
  level.mesh = {};
  const LevelReport report = prepare_level(level, {0.1});
  EXPECT_THAT(report_lines(report), IsEmpty());
  EXPECT_THAT(report_warnings(report), IsEmpty());
}

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
  return Audibility(scene, level.mesh, level.materials).unheard(level.emitters);
}

std::optional<InaudiblePlace> inaudible_at(const Level& level, const Vec3& listener_m) {
  const Scene scene(level.mesh, Scene::Build::kQuick);
  return Audibility(scene, level.mesh, level.materials)
      .inaudible_at(std::span(&listener_m, 1), level.emitters, level.air)[0];
}

TEST(LevelReport, WarnsOfAnEmitterInAPillarAndNamesAPlaceThatWorks) {
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

TEST(LevelReport, WarnsOfAnEmitterOnAWallThatHidesHalfOfItsSound) {
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
  for (std::size_t i = 0; i < 6; ++i) level.emitters[i].name = "e" + std::to_string(i);
  level.emitters[0].position_m = {1, 1, 1};
  const auto warnings = report_warnings(prepare_level(level));
  ASSERT_EQ(warnings.size(), 4u);
  EXPECT_THAT(warnings[0], HasSubstr("emitter 'e1' lies inside a solid"));
  EXPECT_THAT(warnings[3], HasSubstr("2 more emitters"));
}

TEST(LevelReport, FindsNoFaultWithEmittersThatAreHeard) {
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

TEST(Audibility, TellsAListenerWhyNothingIsHeardAndWhereSomethingIs) {
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

TEST(Audibility, BlamesTheEmitterWhereThatIsOutOfPlace) {
  const Level level = hall_with_pillar(kPillar_m);
  const auto found = inaudible_at(level, {1, 1, 1});
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->emitter, 0u);
  const std::string text = in_words(*found, {1, 1, 1}, level.emitters);
  EXPECT_THAT(text,
              HasSubstr("hardly anything is heard at 1,1,1: emitter 'source' lies inside a solid"));
}

TEST(Audibility, HearsThroughADoorAndThroughThinWallsButNotThroughOthers) {
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

TEST(Audibility, BendsRoundAWallInTheOpen) {
  Level level = shoebox({5, 4, 3}, uniform_material(0.1f), {0, 1.5, 2});
  level.mesh = {};
  testing::add_quad(level.mesh, {Vec3f(-2, 0, 0), Vec3f(2, 0, 0), Vec3f(2, 3, 0), Vec3f(-2, 3, 0)});
  EXPECT_FALSE(inaudible_at(level, {0, 1.5, -2}).has_value());
}

TEST(Audibility, OfAFreeFieldEndsWithTheDistance) {
  Level field = shoebox({5, 4, 3}, uniform_material(0.1f), {1, 1, 1});
  field.mesh = {};
  EXPECT_FALSE(inaudible_at(field, {100, 1, 1}).has_value());
  const auto found = inaudible_at(field, {1e9, 1, 1});
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->why, InaudibleCause::kFarAway);
  EXPECT_FALSE(inaudible_at(field, *found->alternative_m).has_value());
}

TEST(LevelReport, TellsNoWidthOfAnOpeningThatOnlyDirectSoundPasses) {
  // All lines meet at the emitter, which is not an opening.
  Level level = without(kCeiling, {6, 4, 3}, 1, {2, 0, 1});
  for (const std::string& line : report_lines(prepare_level(level)))
    EXPECT_EQ(line.find(" mm wide"), std::string::npos) << line;
  Level off = without(kCeiling, {6, 4, 3}, 1, {2, 1, 1});
  const LevelReport report = prepare_level(off);
  ASSERT_FALSE(report.openings.openings.empty());
  EXPECT_EQ(report.openings.openings[0].width_m, 0);
  EXPECT_THAT(report_lines(report), Contains(HasSubstr("leaves the level, upwards: no ceiling")));
}

}  // namespace
}  // namespace clamor
