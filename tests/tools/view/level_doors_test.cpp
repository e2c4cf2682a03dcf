#include "tools/view/level_doors.h"

#include <gtest/gtest.h>

#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/geometry_section.h"
#include "tests/door_level.h"
#include "tests/runtime/door_leaf.h"

namespace clamor::testing {
namespace {

MovablePart lift() { return {"Lift", box_mesh({1, 0.1, 0.5}, 0), {{2, 0, 3}, {1, 0, 0, 0}, 1}}; }

TEST(LevelDoors, TurnOnTheirHingesOrSlideAsideByTheirWidth) {
  EXPECT_EQ(guessed_motion(door(0)), (PartMotion{90, Vec3(0)}));
  const PartMotion slides = guessed_motion(lift());
  EXPECT_EQ(slides.turn_deg, 0);
  EXPECT_NEAR(length(slides.shift_m), 2, 1e-6);
}

// A leaf along +Z from its hinge turns to +X by a quarter of a turn to the left.
TEST(LevelDoors, MoveByAShareOfTheirMotion) {
  const MovablePart leaf = door(0);
  for (const auto& [share, turn_deg] : {std::pair{1.0, 90.0}, {0.5, 45.0}}) {
    const PartPose there = moved(leaf.rest_pose, guessed_motion(leaf), share);
    const double rad = turn_deg * 3.14159265358979 / 180;
    const Mesh turned = placed(leaf.mesh, there);
    const Vec3 edge_m = Vec3(turned.vertices_m[7]) - kHinge_m, at_rest_m(0.02, 1, 2);
    EXPECT_NEAR(edge_m.z, at_rest_m.z * std::cos(rad) - at_rest_m.x * std::sin(rad), 1e-5);
    EXPECT_NEAR(edge_m.x, at_rest_m.z * std::sin(rad) + at_rest_m.x * std::cos(rad), 1e-5);
  }
}

TEST(LevelDoors, StayAsOpenAsTheyWereWhileTheLevelIsEdited) {
  Portal near{"gate", {1, 1, 1}, {0.5, 0, 0}, {0, 1, 0}}, far = near;
  far.centre_m.x = 9;
  const std::vector<MovablePart> parts{door(0)};
  LevelDoors doors;
  doors.update(parts, std::vector{near, far}, Vec3(0));
  doors.open_portal(1, 0);
  doors.move_part(0, 1);
  while (doors.advance(0.1)) {
  }
  far.centre_m.x = 9.5;  // and the first one is removed
  doors.update(parts, std::vector{far}, Vec3(0));
  EXPECT_EQ(doors.portals()[0].share, 0);
  EXPECT_EQ(doors.parts()[0].share, 1);
  // A bake of the level as it was before the edit, whose origin is elsewhere.
  Portal before = far;
  before.centre_m = Vec3(9, 1, 1) - Vec3(100, 0, 0);
  Portal other = before;
  other.name = "another";
  EXPECT_EQ(doors.openness_of(std::vector{other, before}, Vec3(100, 0, 0)),
            (std::vector<float>{1, 0}));
  before.parts = {0};
  EXPECT_EQ(doors.openness_of(std::vector{before}, Vec3(100, 0, 0))[0], kOpenedByParts);
}

TEST(LevelDoors, TellOfEveryMotionOnce) {
  LevelDoors doors;
  doors.update(std::vector{door(0)}, {}, Vec3(0));
  EXPECT_TRUE(doors.advance(0.1)) << "a new level";
  EXPECT_FALSE(doors.advance(0.1));
  doors.move_part(0, 1);
  EXPECT_TRUE(doors.advance(0.1));
  EXPECT_GT(doors.parts()[0].share, 0);
  EXPECT_LT(doors.parts()[0].share, 1) << "a door does not jump";
}

void expect_doorway(const std::optional<Portal>& found, const Vec3& centre_m) {
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(length(found->centre_m - centre_m), 0.01);
  EXPECT_NEAR(2 * length(found->half_u_m), 0.9, 0.01);
  EXPECT_NEAR(2 * length(found->half_v_m), 2, 0.01);
  EXPECT_GT(std::abs(normal_of(*found).x), 0.999) << "it lies in the wall, however one looks at it";
}

TEST(Doorway, IsTheHoleInTheWallThatIsLookedThrough) {
  const Mesh rooms = rooms_with_doorway();
  for (const Vec3& eye_m : {Vec3(2, 1.6, 2.5), Vec3(4.5, 1.7, 1.6), Vec3(9, 1.5, 2.8)})
    expect_doorway(doorway_ahead(rooms, eye_m, Vec3(6, 1, 2.5) - eye_m), {6, 1, 2.5});
  EXPECT_FALSE(doorway_ahead(rooms, {2, 1.6, 2.5}, {-1, 0, 0})) << "that wall has no hole";
}

TEST(Doorway, LiesInTheMiddleOfAThickWall) {
  Mesh rooms = box({12, 2.7, 5});
  const auto add = [&](const Vec3& low, const Vec3& high) {
    Mesh block = box_mesh((high - low) / 2.0, 0);
    for (Vec3f& vertex : block.vertices_m) vertex += Vec3f((low + high) / 2.0);
    append(block, rooms);
  };
  add({5.9, 0, 0}, {6.1, 2.7, 2.05});
  add({5.9, 0, 2.95}, {6.1, 2.7, 5});
  add({5.9, 2, 2.05}, {6.1, 2.7, 2.95});
  expect_doorway(doorway_ahead(rooms, {2, 1.6, 2.2}, {1, 0, 0.05}), {6, 1, 2.5});
}

TEST(Doorway, OfAPartIsWhatTheLeafFills) {
  const Portal portal = doorway_of(door(0));
  EXPECT_EQ(portal.name, "Door");
  EXPECT_LT(length(portal.centre_m - (kHinge_m + Vec3(0, 0.5, 1))), 1e-6);
  EXPECT_NEAR(2 * length(portal.half_u_m), 2, 1e-6);
  EXPECT_NEAR(2 * length(portal.half_v_m), 1, 1e-6);
  EXPECT_NEAR(std::abs(normal_of(portal).x), 1, 1e-6);
}

TEST(Doorway, HasMoreSlatsTheFurtherItIsClosed) {
  const Portal portal = usual_doorway({0, 1.7, 0}, {0, 0, -1});
  EXPECT_EQ(lines_of(portal, 1).size(), 8u) << "the edge alone";
  EXPECT_GT(lines_of(portal, 0).size(), lines_of(portal, 0.5).size());
  EXPECT_GT(lines_of(portal, 0.5).size(), 8u);
}

}  // namespace
}  // namespace clamor::testing
