#include "tools/view/level_shapes.h"

#include <numbers>

#include <gtest/gtest.h>

#include "tests/box_level.h"
#include "tests/box_mesh.h"
#include "tools/view/view_script.h"
#include "tools/view/voice_display.h"
#include "tools/view/walk_camera.h"

namespace clamor::testing {
namespace {

using std::numbers::pi;

TEST(Picking, FindsTheTriangleThatARayHitsFirst) {
  const Mesh room = box({4, 3, 5});
  const PickedTriangle floor = pick(room, {1, 1.5, 2}, {0, -1, 0});
  ASSERT_LT(floor.triangle, room.triangles.size());
  EXPECT_NEAR(floor.distance_m, 1.5, 1e-6);
  for (const std::uint32_t corner : room.triangles[floor.triangle])
    EXPECT_EQ(room.vertices_m[corner].y, 0);
  EXPECT_EQ(pick(room, {10, 1, 1}, {1, 0, 0}).triangle, SIZE_MAX);
}

TEST(Picking, FindsAnEmitterInFrontOfAWallAndNoneBehindIt) {
  const std::vector<Vec3> places{{0, 0, -3}, {0, 0, -8}};
  EXPECT_EQ(pick_point(places, Vec3(0), normalize(Vec3(0.01, 0, -1)), 5), 0u);
  EXPECT_EQ(pick_point(places, Vec3(0, 0, -4), Vec3(0, 0, -1), 2), SIZE_MAX);
  EXPECT_EQ(pick_point(places, Vec3(0), normalize(Vec3(0.3, 0, -1)), 5), SIZE_MAX);
}

TEST(SurfaceOutline, OfABoxIsItsTwelveEdges) {
  const Mesh room = box({4, 3, 5});
  const auto surface = surface_of(room, 0);
  EXPECT_EQ(surface.size(), 12u);  // one material, connected
  const auto ends = outline_of(room, surface);
  EXPECT_EQ(ends.size(), 2 * 12u);
  double length_m = 0;
  for (std::size_t i = 0; i < ends.size(); i += 2)
    length_m += static_cast<double>(length(ends[i + 1] - ends[i]));
  EXPECT_NEAR(length_m, 4 * (4 + 3 + 5), 1e-4) << "no diagonals";
}

TEST(SurfaceOutline, EndsWhereTheMaterialDoes) {
  Mesh room = box({4, 3, 5});
  for (auto& material : room.materials) material = 1;
  room.materials[0] = room.materials[1] = 0;
  EXPECT_EQ(surface_of(room, 0).size(), 2u);
  EXPECT_EQ(outline_of(room, surface_of(room, 0)).size(), 2 * 4u);
}

// The texture has a white, a black and a transparent pixel: half of the light, of which the factor
// lets red pass.
TEST(BaseColours, OfATextureAreItsMeanTimesTheFactor) {
  const Folder folder;
  const std::string level = level_of(folder, box({4, 3, 5}), R"(, "materials": [
      {"name": "cloth", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0},
                                                 "baseColorFactor": [1, 0.5, 0, 1]}},
      {"name": "broken", "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}},
      {"name": "plain", "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 1]}}],
    "textures": [{"source": 0}, {"source": 1}],
    "images": [{"uri": "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAMAAAABCAYAAAAb4BS0AAAAEklEQVR42mP4DwQMDAz/gZABADHbBfup5IJeAAAAAElFTkSuQmCC"},
               {"uri": "data:image/png;base64,iVBO"}])",
                                     R"(, "material": 0)");
  const auto colours = base_colours(level);
  ASSERT_EQ(colours.size(), 2u);
  EXPECT_LT(length(colours.at("cloth") - Vec3f(0.5f, 0.25f, 0)), 1e-6f);
  EXPECT_LT(length(colours.at("plain") - Vec3f(0.1f, 0.2f, 0.3f)), 1e-6f);
}

// From inside a box with a hole, the hole is seen in the middle of the picture and nothing is in
// front of it, though there is more room outside.
TEST(Viewpoint, LooksAtAHoleFromWhereTheSoundIs) {
  Mesh room = box({6, 3, 4});
  room.triangles.resize(10);  // no wall z = 4
  room.materials.resize(10);
  const Vec3 hole_m(3, 1.5, 4), violin_m(3, 1, 1);
  const Listener at = viewpoint_of(room, hole_m, 3, std::span(&violin_m, 1));
  EXPECT_LT(at.position_m.z, 3.9);
  EXPECT_GT(at.position_m.y, 0);
  EXPECT_LT(at.position_m.y, 3);
  EXPECT_GT(length(hole_m - at.position_m), 1.5);
  EXPECT_LT(length(at.forward() - normalize(hole_m - at.position_m)), 1e-9);
  EXPECT_EQ(pick(room, at.position_m, at.forward()).triangle, SIZE_MAX);
}

TEST(WalkCameraTest, ProjectsWhereItsRaysPoint) {
  WalkCamera camera(Listener({1, 1.7, 2}, 0.7, -0.3));
  for (const double x : {0.1, 0.5, 0.8})
    for (const double y : {0.2, 0.5, 0.9}) {
      const Vec3 point_m = camera.listener().position_m + 4.0 * camera.ray(x, y, 1.6);
      double at_x = 0, at_y = 0;
      ASSERT_TRUE(camera.project(point_m, 1.6, at_x, at_y));
      EXPECT_NEAR(at_x, x, 1e-9);
      EXPECT_NEAR(at_y, y, 1e-9);
    }
}

TEST(WalkCameraTest, WalksOnTheLevelHoweverItLooks) {
  WalkCamera camera(Listener({0, 1.7, 0}, 0, 1.2));
  for (int i = 0; i < 100; ++i) camera.advance({.ahead = 1}, 0.02);
  const Vec3 at = camera.listener().position_m;
  EXPECT_NEAR(at.y, 1.7, 1e-9);
  EXPECT_NEAR(at.x, 0, 1e-9);
  EXPECT_NEAR(at.z, -2 * (2.0 - 0.12), 0.1) << "2 m/s for 2 s, but for the start";
  camera.look(pi, 10);
  EXPECT_LT(camera.pitch_rad(), pi / 2) << "up ends at the pole";
}

TEST(VoiceDisplayTest, FadesVoicesInAndOut) {
  VoiceDisplay display;
  const std::vector<HeardSource> heard{{.number = 1, .power = 1},
                                       {.number = 2, .power = 1e-3f, .power_gain = 0.001f}};
  display.update(heard, 0.05);
  ASSERT_EQ(display.points().size(), 2u);
  EXPECT_EQ(display.hidden(), 1u);
  for (const VoicePoint& point : display.points()) EXPECT_FLOAT_EQ(point.opacity, 0.5f);
  display.update(heard, 1);
  display.update({}, 0.05);
  ASSERT_EQ(display.points().size(), 2u) << "they fade out";
  display.update({}, 0.06);
  EXPECT_TRUE(display.points().empty());
}

TEST(ViewScript, NamesTheLineThatItDoesNotUnderstand) {
  const auto right = parse_view_script(
      "size 800 600\n\nmove world 1 2 -3 # a comment\nmove \"Face me\"\n"
      "key Ctrl+Z\nkey W down\nwait final\nquit\n");
  ASSERT_TRUE(right.ok()) << right.error().message;
  ASSERT_EQ(right->size(), 7u);
  EXPECT_EQ((*right)[1].z, -3);
  EXPECT_EQ((*right)[2].text, "Face me");
  EXPECT_EQ((*right)[4].kind, ViewEvent::Kind::kKeyDown);
  const auto wrong = parse_view_script("quit\nmove there\n");
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().message.find("line 2"), std::string::npos);
}

TEST(ViewScript, WaitsNoLongerThanItSaysOrAnHour) {
  const auto events = parse_view_script("wait rebaked\nwait final 2.5\nwait sound 0\n");
  ASSERT_TRUE(events.ok()) << events.error().message;
  EXPECT_EQ((*events)[0].x, 3600);
  EXPECT_EQ((*events)[1].x, 2.5);
  EXPECT_EQ((*events)[2].x, 0);
}

TEST(ViewScript, NamesTheValueAndItsRangeInAnAbsurdLine) {
  const auto why = [](const std::string& line) {
    const auto events = parse_view_script("wait sound\n" + line + "\n");
    return events.ok() ? "" : events.error().message;
  };
  EXPECT_EQ(why("size 0 720"),
            "line 2: 'size 0 720' has 0: the width must be a whole number from 480 to 8192");
  EXPECT_EQ(
      why("size 1280 1e300"),
      "line 2: 'size 1280 1e300' has 1e300: the height must be a whole number from 360 to 8192");
  EXPECT_EQ(
      why("wait seconds 1e12"),
      "line 2: 'wait seconds 1e12' has 1e12: the number of seconds must be a number from 0 to "
      "3600");
  EXPECT_EQ(
      why("wait frames -1"),
      "line 2: 'wait frames -1' has -1: the number of frames must be a whole number from 0 to "
      "100000");
  EXPECT_NE(why("wait frames 2.5").find("a whole number"), std::string::npos);
  EXPECT_NE(why("move 5").find("lacks a number: the Y must be"), std::string::npos);
  EXPECT_NE(why("move nan 5").find("has 'nan'"), std::string::npos);
  EXPECT_NE(why("scroll 1e9").find("from -1000 to 1000"), std::string::npos);
  EXPECT_NE(why("click twice").find("has 'twice' too many"), std::string::npos);
  EXPECT_NE(why("wait rebaked 3601").find("from 0 to 3600"), std::string::npos);
  EXPECT_EQ(why("size 480 360"), "");
  EXPECT_EQ(why("wait seconds 0.5"), "");
}

}  // namespace
}  // namespace clamor::testing
