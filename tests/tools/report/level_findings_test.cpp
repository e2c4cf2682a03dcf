// Tests that a report leads to what is wrong with a level.
#include "tools/report/level_findings.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>

#include "tests/tools/report/reported_room.h"
#include "tools/report/room_summary.h"

namespace clamor::testing {
namespace {

using Kind = LevelFinding::Kind;

std::vector<LevelFinding> of_kind(const std::vector<LevelFinding>& found, Kind kind) {
  std::vector<LevelFinding> some;
  std::ranges::copy_if(found, std::back_inserter(some),
                       [&](const LevelFinding& finding) { return finding.kind == kind; });
  return some;
}

// A hole of 1 x 1 m in the wall z = 0 of a box.
Level with_a_hole() {
  Level level = shoebox({6, 3, 4}, uniform_material(0.2f), {2, 1, 2});
  Mesh& mesh = level.mesh;
  for (std::size_t t = mesh.triangles.size(); t-- > 0;) {
    const auto& corners = mesh.triangles[t];
    if (std::all_of(corners.begin(), corners.end(),
                    [&](std::uint32_t corner) { return mesh.vertices_m[corner].z == 0; })) {
      mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(t));
      mesh.materials.erase(mesh.materials.begin() + static_cast<std::ptrdiff_t>(t));
    }
  }
  const auto wall = [&](float x0, float x1, float y0, float y1) {
    add_quad(mesh, {Vec3f(x0, y0, 0), Vec3f(x1, y0, 0), Vec3f(x1, y1, 0), Vec3f(x0, y1, 0)});
  };
  wall(0, 4, 0, 3), wall(5, 6, 0, 3), wall(4, 5, 0, 1), wall(4, 5, 2, 3);
  return level;
}

TEST(LevelFindings, LeadToTheHoleThroughWhichSoundEscapes) {
  const ReportedRoom reported(with_a_hole(), 200, 2000);
  const auto openings = of_kind(findings_of(reported.file().statistics()), Kind::kOpening);
  ASSERT_EQ(openings.size(), 1u);
  ASSERT_TRUE(openings[0].place_m);
  EXPECT_LT(length(*openings[0].place_m - Vec3(4.5, 1.5, 0)), 0.3);
  EXPECT_NEAR(openings[0].size_m, 1.1, 0.4);  // an equivalent disc is 1.13 m wide
  EXPECT_LT(openings[0].direction.z, -0.5);
  EXPECT_THAT(openings[0].text, ::testing::HasSubstr("% of the sound leaves towards -Z"));
}

TEST(LevelFindings, SayThatABoxIsClosedAndShowNoGaps) {
  const ReportedRoom reported(shoebox({6.0003, 3.0007, 4.0001}, uniform_material(0.2f), {2, 1, 2}),
                              200, 2000);
  const auto found = findings_of(reported.file().statistics());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].kind, Kind::kFact);
  EXPECT_THAT(found[0].text, ::testing::StartsWith("closed: none of"));
}

TEST(LevelFindings, LeadToAThinGapAndToFacesThatAreThereTwice) {
  Level level = shoebox({6, 3, 4}, uniform_material(0.2f), {2, 1, 2});
  level.materials.push_back(level.materials[0]);
  level.materials[0].name = "brick";
  level.materials[1].name = "felt";
  // Two boards of 2 m with a gap of 1 cm between them, and a table top in two materials.
  const auto board = [&](float from, float to) {
    add_quad(level.mesh, {Vec3f(2, 1, from), Vec3f(4, 1, from), Vec3f(4, 1, to), Vec3f(2, 1, to)});
  };
  board(1, 2), board(2.01f, 3);
  for (const std::uint16_t material : {0, 1})
    add_quad(level.mesh, {Vec3f(5, 2, 1), Vec3f(5.5, 2, 1), Vec3f(5.5, 2, 3), Vec3f(5, 2, 3)},
             material);
  const ReportedRoom reported(level, 200, 2000);
  const auto found = findings_of(reported.file().statistics());
  const auto gaps = of_kind(found, Kind::kGap), twice = of_kind(found, Kind::kDuplicate);
  ASSERT_EQ(gaps.size(), 1u);
  EXPECT_NEAR(gaps[0].place_m->y, 1, 0.01);
  EXPECT_NEAR(gaps[0].place_m->z, 2, 0.02);
  ASSERT_EQ(twice.size(), 1u);
  ASSERT_TRUE(twice[0].place_m) << twice[0].text;
  EXPECT_LT(length(*twice[0].place_m - Vec3(5.25, 2, 2)), 0.5);
}

TEST(LevelFindings, ReadPlacesInWarnings) {
  const auto expect = [](const std::string& text, const std::optional<Vec3>& place_m) {
    const auto found = place_in(text);
    ASSERT_EQ(found.has_value(), place_m.has_value()) << text;
    if (found) {
      EXPECT_LT(length(*found - *place_m), 1e-12) << text;
    }
  };
  expect("2 % leaves near (1.0, -2.5, 3.0), through", Vec3(1, -2.5, 3));
  expect("'a (b)' is inside a solid; nearest (1, 2, 3)", Vec3(1, 2, 3));
  expect("probe 2 at 1,1.5,3 lies inside", Vec3(1, 1.5, 3));
  expect("at first sight (nothing)", std::nullopt);
  expect("(1, 2)", std::nullopt);
  expect("(nan, 1, 2)", std::nullopt);
}

TEST(RoomSummary, CountsTheSoundThatMeetsEachMaterialAndNamesWhatBooms) {
  Level level = shoebox({6, 3, 4}, uniform_material(0.1f), {2, 1, 2});
  level.materials[0].name = "board";
  level.materials[0].absorption = {0.02f, 0.02f, 0.03f, 0.3f, 0.4f, 0.4f, 0.4f, 0.4f};
  level.materials.push_back(uniform_material(0.4f));
  level.materials[1].name = "cloth";
  level.mesh = box({6, 3, 4}, {0, 0, 1, 0, 0, 0});  // cloth on the floor
  level.materials.push_back(uniform_material(1));
  level.materials[2].name = "outside";
  add_wall_across(level.mesh, 8, {6, 3, 4}, 2);
  const ReportedRoom reported(level);
  const Room room = reported.room();
  const auto met = met_materials(reported.file());
  ASSERT_EQ(met.size(), 2u) << "no sound meets the walls outside";
  EXPECT_EQ(met[0].name, "board");
  EXPECT_EQ(met[1].name, "cloth");
  // In a diffuse field the sound meets each of the 108 m2 as often. The emitter is nearer to the
  // floor, and the first reflections count most where the cloth absorbs 0.4.
  for (std::size_t b = 0; b < kBandCount; ++b)
    EXPECT_NEAR(met[1].arrived[b] / (met[0].arrived[b] + met[1].arrived[b]), 24.0 / 108, 0.06);
  // Nothing leaves the closed room, and air takes little of the low bands.
  EXPECT_NEAR((met[0].dissipated(0) + met[1].dissipated(0)) /
                  static_cast<double>(reported.file().statistics().power_emitted[0]),
              1, 0.05);

  const RoomMeter meter(room, *excitation_of(room, ""));
  const std::vector<RoomResponse> responses = {meter.measure({4, 1.5, 2}, RoomMeter::kAll)};
  EXPECT_GT(bass_ratio(responses).value_or(0), 1.45);
  EXPECT_THAT(described(responses, Enclosure::kClosed), ::testing::HasSubstr("It booms"));
  const std::string cause = cause_of_decay(responses, met);
  // 0.02 and 0.03 of 84 m2 and 0.4 of 24 m2 are 11 % of 108 m2.
  EXPECT_THAT(cause,
              ::testing::ContainsRegex("absorb 1[0-3] % of the sound that meets them at 125"));
  EXPECT_THAT(cause, ::testing::ContainsRegex("'board' reflects most: 7[3-9] % of the sound"));
  EXPECT_THAT(cause, ::testing::HasSubstr("it absorbs 2 % of that"));
  EXPECT_EQ(cause_of_decay(reported.file().statistics().decay, met), cause);
}

TEST(RoomSummary, TellsHowMuchAnAbsorptionChangesTheDecay) {
  Level level = shoebox({6, 3, 4}, uniform_material(0.2f), {2, 1, 2});
  level.materials.push_back(uniform_material(0.2f));
  level.materials[0].name = "board";
  level.materials[1].name = "cloth";
  level.materials[1].scattering.fill(0.9f);  // or they would be one
  level.mesh = box({6, 3, 4}, {0, 0, 1, 0, 0, 0});
  const ReportedRoom reported(level);
  const auto deciding = deciding_materials(reported.file());
  ASSERT_EQ(deciding.size(), 2u);
  EXPECT_EQ(deciding[0].name, "board");
  EXPECT_EQ(deciding[1].name, "cloth");
  // Of all surfaces together: T is inverse to -ln(1 - a) by Eyring's formula, but for the air, which
  // takes little at 500 Hz. Unequal path lengths change it by some per cent, and so does noise.
  const double t30_s = reported.file().statistics().decay.t30_s[3];
  EXPECT_NEAR((deciding[0].slope_s[3] + deciding[1].slope_s[3]) / (t30_s / (0.8 * std::log(0.8))), 1,
              0.12);
  // 24 of 108 m2; see above.
  EXPECT_NEAR(deciding[1].slope_s[3] / deciding[0].slope_s[3], 24.0 / 84, 0.08);
}

// A yard decays as fast as a studio, and is none.
TEST(RoomSummary, ComparesALevelThatIsMostlyOpenWithNoRoom) {
  RoomResponse response;
  response.parameters.t30_s.fill(0.3);
  const std::vector<RoomResponse> responses = {response};
  EXPECT_THAT(described(responses, Enclosure::kClosed), ::testing::HasSubstr("like a studio"));
  EXPECT_THAT(described(responses, Enclosure::kMostlyOpen),
              ::testing::AllOf(::testing::Not(::testing::HasSubstr("studio")),
                               ::testing::HasSubstr("half of the sound leaves it")));
}

}  // namespace
}  // namespace clamor::testing
