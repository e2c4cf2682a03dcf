// Tests of what the report tells a designer before the bake.
#include "bake/report/level_report.h"

#include <array>
#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bake/bake.h"
#include "bake/report/lost_power.h"
#include "bake/trace/photon_tracer.h"
#include "formats/bake_file/enclosure.h"
#include "tests/bake/mesh/mesh_shapes.h"
#include "tests/bake/report/open_box.h"

namespace clamor {
namespace {

using testing::box;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kCeiling;
using testing::kFloor;
using testing::kFront;
using testing::kLeft;
using testing::shoebox;
using testing::uniform_material;
using testing::Wall;
using testing::without;

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

TEST(LevelReport, CallsAnAtticClosedWhoseRoofMeetsItsFloorAtAnAcuteAngle) {
  Level attic = shoebox({6, 2, 8}, uniform_material(0.02f), {3, 0.5, 1});
  for (Vec3f& corner : attic.mesh.vertices_m)
    if (corner.y > 0) corner.x = 3 + 0.01f * (corner.x - 3);
  const LevelReport report = prepare_level(attic);
  EXPECT_EQ(report.openings.escaped, 0u);
  EXPECT_GT(report.openings.rays, 100'000u);
}

TEST(LevelReport, EscapedShareOfBlackWallsIsTheSolidAngleOfTheOpening) {
  // From the centre of a cube each side covers a sixth of all directions. Four standard deviations
  // for 2048 rays.
  const double bound = 4 * std::sqrt(1.0 / 6 * 5 / 6 / 2048);
  for (const Wall wall : {kLeft, kFloor, kCeiling, kFront}) {
    Level level = without(wall, {4, 4, 4}, 1, {2, 2, 2});
    EXPECT_NEAR(prepare_level(level).openings.escaped_share, 1.0 / 6, bound);
  }
}

TEST(LevelReport, PredictsTheEscapedPowerOfTheBake) {
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

TEST(LevelReport, LocatesTheOpening) {
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

TEST(LevelReport, SeparatesTwoOpenings) {
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

TEST(LevelReport, FindsASlitUnderADoorButNoneUnderAWallOnTheFloor) {
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

// A room of panels, each of which rounds its corners to steps from an origin of its own, as
// KHR_mesh_quantization does.
Level room_of_rounded_panels(double step_m) {
  const Level whole = shoebox({4, 3, 5}, uniform_material(0.1f), {1, 1, 1});
  Level level = whole;
  level.mesh = {};
  std::uint32_t panels = 0;
  for (std::size_t t = 0; t + 1 < whole.mesh.triangles.size(); t += 2) {
    const auto corner = [&](std::size_t triangle, std::size_t c) {
      return Vec3(whole.mesh.vertices_m[whole.mesh.triangles[triangle][c]]);
    };
    // The two triangles of a side are a parallelogram from its first corner.
    const Vec3 from = corner(t, 0), u = corner(t, 1) - from, v = corner(t + 1, 2) - from;
    constexpr int kAcross = 4;
    for (int i = 0; i < kAcross; ++i)
      for (int j = 0; j < kAcross; ++j) {
        const RandomBits bits = philox(9, {++panels, 0, 0, 0});
        const Vec3 origin = Vec3(unit(bits[0]), unit(bits[1]), unit(bits[2]));
        const auto at = [&](int x, int y) {
          const Vec3 exact = from + u * (double(x) / kAcross) + v * (double(y) / kAcross);
          return Vec3f(origin + step_m * glm::round((exact - origin) / step_m));
        };
        testing::add_quad(level.mesh, {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
  }
  return level;
}

TEST(LevelReport, CallsARoomOfQuantisedPanelsClosed) {
  for (const double step_m : {1e-4, 2e-3}) {
    Level level = room_of_rounded_panels(step_m);
    LevelOptions options;
    options.rounding_m = std::sqrt(3) * step_m;
    const LevelReport report = prepare_level(level, options);
    EXPECT_EQ(report.openings.escaped, 0u) << step_m;
    EXPECT_NEAR(report.volume_m3, 60, 100 * step_m);
    EXPECT_TRUE(report.gaps.empty());
  }
}

TEST(LevelReport, SaysThatPositionsAreRoundedWhereItDoesNotKnowTheStep) {
  Level level = room_of_rounded_panels(1.5e-4);
  const LevelReport report = prepare_level(level);
  EXPECT_GT(report.openings.escaped, 0u);
  EXPECT_NEAR(report.widest_seam_m, 1.5e-4, 1e-4);
  EXPECT_THAT(report_warnings(report), Contains(HasSubstr("through seams")));
  EXPECT_THAT(report_warnings(report), Contains(HasSubstr("as rounded positions leave them")));
  EXPECT_TRUE(findings_in(report).list.empty());
}

TEST(LevelReport, OfALevelThatAProgramQuantisedIsThatOfTheLevel) {
  const std::string folder = testing::shared_case("quantised_cracks/");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no shared cases here";
  std::array<LevelReport, 2> reports;
  for (std::size_t i = 0; i < 2; ++i) {
    ImportOptions options;
    options.emitters = {"name=e,signal=impulse,at=1,1,0"};
    auto imported = import_level(folder + (i == 0 ? "r1.glb" : "r1_qs.glb"), options);
    ASSERT_TRUE(imported.ok()) << imported.error().message;
    LevelOptions prepared;
    prepared.rounding_m = imported->rounding_m;
    reports[i] = prepare_level(imported->level, prepared);
  }
  EXPECT_EQ(reports[1].openings.escaped, 0u);
  EXPECT_EQ(reports[1].welded_vertices, reports[0].welded_vertices);
  EXPECT_NEAR(reports[1].volume_m3 / reports[0].volume_m3, 1, 1e-4);
  EXPECT_TRUE(reports[1].gaps.empty());
}

TEST(LevelReport, WarnsOfCoincidentFacesWithDifferentMaterials) {
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

TEST(LevelReport, QuestionsTheUnitOfTinyAndHugeLevels) {
  Level tiny = shoebox({0.05, 0.04, 0.03}, uniform_material(0.1f), {0.01, 0.01, 0.01});
  EXPECT_THAT(report_warnings(prepare_level(tiny)), Contains(HasSubstr("another unit?")));
  Level huge = shoebox({500, 400, 300}, uniform_material(0.1f), {10, 10, 10});
  EXPECT_THAT(report_warnings(prepare_level(huge)), Contains(HasSubstr("another unit?")));
}

TEST(LevelReport, TellsPlacesInTheWorld) {
  Level level = shoebox({6, 4, 3}, uniform_material(0.1f), {2, 1, 1});
  level.mesh.triangles.erase(level.mesh.triangles.begin());  // half of the wall x = 0
  level.mesh.materials.erase(level.mesh.materials.begin());
  const LevelReport near = prepare_level(level);
  level.origin_m = {530'100, 0, -2'600'000};
  const LevelReport far = prepare_level(level);
  ASSERT_FALSE(near.openings.openings.empty());
  ASSERT_EQ(far.openings.openings.size(), near.openings.openings.size());
  EXPECT_EQ(far.openings.openings[0].place_m, near.openings.openings[0].place_m + level.origin_m);
  const LevelFindings found = findings_in(far);
  EXPECT_THAT(found.closedness, HasSubstr("near (530100."));
  EXPECT_EQ(found.list[0].place_m, far.openings.openings[0].place_m);
  Level closed = shoebox({6, 4, 3}, uniform_material(0.1f), {-2, 1, 1});
  closed.origin_m = level.origin_m;
  EXPECT_THAT(report_warnings(prepare_level(closed)),
              Contains(HasSubstr("the nearest place found that works is 5301")));
}

TEST(LevelReport, ReportsSavedTrianglesAndChangedAreas) {
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

TEST(LevelReport, GivesNoWidthForOpeningsReachedByDirectSoundOnly) {
  // All lines meet at the emitter, which is not an opening.
  Level level = without(kCeiling, {6, 4, 3}, 1, {2, 0, 1});
  for (const std::string& line : report_lines(prepare_level(level)))
    EXPECT_EQ(line.find(" mm wide"), std::string::npos) << line;
  Level off = without(kCeiling, {6, 4, 3}, 1, {2, 1, 1});
  const LevelReport report = prepare_level(off);
  ASSERT_FALSE(report.openings.openings.empty());
  EXPECT_EQ(report.openings.openings[0].width_m, 0);
  EXPECT_THAT(report_warnings(report),
              Contains(HasSubstr("leaves the level, upwards: no ceiling")));
}

TEST(LevelReport, WarnsOfOpeningsUnlessMostSoundLeaves) {
  Level without_wall = without(kLeft, {6, 4, 3}, 0.3f, {3, 2, 1.5});
  const LevelReport open_wall = prepare_level(without_wall);
  EXPECT_EQ(enclosure_of(findings_in(open_wall)), Enclosure::kOpenings);
  EXPECT_THAT(report_warnings(open_wall), Contains(HasSubstr("is a wall or a door missing?")));

  Level yard = shoebox({20, 1, 20}, uniform_material(0.3f), {10, 1.5, 10});
  yard.mesh.triangles = {yard.mesh.triangles[4], yard.mesh.triangles[5]};  // its floor
  yard.mesh.materials.resize(2);
  const LevelReport in_the_open = prepare_level(yard);
  EXPECT_EQ(enclosure_of(findings_in(in_the_open)), Enclosure::kMostlyOpen);
  EXPECT_THAT(report_warnings(in_the_open), IsEmpty());
  Level room = shoebox({6, 4, 3}, uniform_material(0.3f), {3, 2, 1});
  EXPECT_EQ(enclosure_of(findings_in(prepare_level(room))), Enclosure::kClosed);
}

// The two ends of a tunnel are found as two openings, or as one whose mean direction vanishes.
TEST(LevelReport, DoesNotPutAShortTunnelInTheOpen) {
  for (const double length_m : {4.0, 8.0, 30.0}) {
    Level tunnel = without(kLeft, {length_m, 3, 4}, 0.3f, {length_m / 2, 1.5, 2});
    tunnel.mesh.triangles.erase(tunnel.mesh.triangles.begin(), tunnel.mesh.triangles.begin() + 2);
    tunnel.mesh.materials.resize(8);
    const std::string words = findings_in(prepare_level(tunnel)).closedness;
    EXPECT_THAT(words, HasSubstr("X")) << length_m;
    EXPECT_THAT(words, ::testing::Not(HasSubstr("in the open"))) << length_m;
  }
}

TEST(LevelReport, WarnsOfEmittersThatSoundAlikeAtOnePlaceAndTime) {
  Level level = shoebox({6, 4, 3}, uniform_material(0.3f), {3, 2, 1});
  level.emitters.resize(100, level.emitters[0]);
  EXPECT_THAT(report_warnings(prepare_level(level)),
              Contains(::testing::AllOf(HasSubstr("100 emitters sound alike"), HasSubstr("20.0 dB"),
                                        HasSubstr("one emitter of gain x100"))));
  for (std::size_t i = 0; i < 100; ++i) level.emitters[i].delay_s = 0.01 * static_cast<double>(i);
  EXPECT_THAT(report_warnings(prepare_level(level)), IsEmpty());
}

// lost_power.h: which way power left a level.
double escaped_share(const BakeStatistics& statistics) {
  return sum_of(statistics.power_escaped) / sum_of(statistics.power_emitted);
}

BakeContents baked(Level level, float transmission) {
  level.materials[0].transmission = same_in_all_bands(transmission);
  const LevelReport report = prepare_level(level);
  BakeOptions options;
  options.settings.photons = 4000;
  BakeContents contents = *bake(level, options);
  contents.statistics.findings = findings_in(report);
  return contents;
}

// No line leaves it, but its walls let half of what they do not reflect out; air takes a quarter of
// the highest octave, and 4 % of all.
TEST(LostPower, OfAClosedLevelPassedItsWalls) {
  const BakeContents closed = baked(shoebox({6, 4, 3}, uniform_material(0.2f), {1, 1, 1}), 0.1f);
  const LostPower lost = lost_power(closed.statistics, closed.materials);
  EXPECT_EQ(lost.through_openings, 0);
  EXPECT_NEAR(lost.through_walls, 0.48, 0.015);
  EXPECT_EQ(ways_of(lost), "through walls");
}

TEST(LostPower, LeftThroughOpeningsWhereWallsTransmitNothing) {
  const BakeContents open = baked(without(kCeiling, {6, 4, 3}, 0.3f, {2, 1, 1}), 0);
  const LostPower lost = lost_power(open.statistics, open.materials);
  EXPECT_EQ(lost.through_walls, 0);
  EXPECT_DOUBLE_EQ(lost.through_openings, escaped_share(open.statistics));
  EXPECT_EQ(ways_of(lost), "through openings");
}

TEST(LostPower, IsSharedOutAmongOpeningsAndWalls) {
  const BakeContents both = baked(without(kCeiling, {6, 4, 3}, 0.3f, {2, 1, 1}), 0.15f);
  const LostPower lost = lost_power(both.statistics, both.materials);
  // The openings take what they take where walls absorb what they transmit here.
  const BakeContents opaque = baked(without(kCeiling, {6, 4, 3}, 0.3f, {2, 1, 1}), 0);
  const double through_openings = escaped_share(opaque.statistics);
  EXPECT_NEAR(lost.through_openings, through_openings, 0.03 * through_openings);
  EXPECT_NEAR(lost.through_walls, (1 - through_openings) / 2, 0.03);
  EXPECT_DOUBLE_EQ(lost.through_openings + lost.through_walls, escaped_share(both.statistics));
}

TEST(LostPower, IsNotDividedWhereTheFileDoesNotKnowItsOpenings) {
  BakeContents older = baked(shoebox({6, 4, 3}, uniform_material(0.2f), {1, 1, 1}), 0.1f);
  older.statistics.findings = {};
  EXPECT_EQ(lost_power(older.statistics, older.materials).through_walls, 0);
  EXPECT_EQ(in_words(LostPower{}), "0.0 % of the power");
  EXPECT_EQ(in_words(LostPower{0.2, 0.1}),
            "30.0 % of the power, 20.0 % through openings and 10.0 % through walls");
}

}  // namespace
}  // namespace clamor
