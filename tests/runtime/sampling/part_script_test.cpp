// part_script_test.cpp: movable parts that follow a script.
#include "runtime/sampling/part_script.h"

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "formats/files/json.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/sampling/moving_script.h"
#include "tests/runtime/door_leaf.h"

namespace clamor {
namespace {

using testing::door;
using testing::door_leaf;
using testing::kHinge_m;

Result<PartScript> parsed(const std::string& text) {
  return PartScript::parse(*parse_json(text), "script.json");
}

// A level with a door that is turned by 30 degrees about +Y at rest.
struct DoorStage {
  DoorStage() {
    level.front().rest_pose.rotation = Rotation(glm::angleAxis(glm::radians(30.0), Vec3(0, 1, 0)));
    for (const MovablePart& part : level)
      handles.push_back(
          *parts.add(*PartShape::make(part.mesh, std::vector<Material>(1)), part.rest_pose));
  }
  PartPose pose(PartScript& script, double time_s, std::size_t part = 0) {
    EXPECT_TRUE(script.apply({&parts, handles, level}, time_s).ok());
    return parts.parts()[part].pose;
  }

  MovingParts parts;
  std::vector<MovablePart> level{door(0)};
  std::vector<PartHandle> handles;
};

double angle_deg(const Rotation& rotation) {
  return glm::degrees(2 *
                      std::atan2(static_cast<double>(rotation.y), static_cast<double>(rotation.w)));
}

TEST(PartScript, TurnsADoorFromHowItIsAtRest) {
  auto script = parsed(R"([{ "name": "Door", "points": [
      { "time_s": 2 }, { "time_s": 3, "yaw_deg": 90 },
      { "time_s": 4, "yaw_deg": 90, "position_m": [0, 1, 0] } ] }])");
  ASSERT_TRUE(script.ok()) << script.error().message;
  DoorStage stage;
  ASSERT_TRUE(script->check(stage.level).ok());
  for (const auto& [time_s, expected_deg] :
       {std::pair(0.0, 30.0), {2.0, 30.0}, {2.25, 52.5}, {2.5, 75.0}, {3.0, 120.0}, {9.0, 120.0}})
    EXPECT_NEAR(angle_deg(stage.pose(*script, time_s).rotation), expected_deg, 1e-3) << time_s;
  EXPECT_EQ(stage.pose(*script, 3).position_m, kHinge_m);
  EXPECT_LT(length(stage.pose(*script, 3.5).position_m - (kHinge_m + Vec3(0, 1, 0)) / 2.0), 1e-9);
  EXPECT_EQ(stage.pose(*script, 4).position_m, Vec3(0, 1, 0));
}

TEST(PartScript, TakesTheShorterArc) {
  auto script = parsed(R"([{ "name": "Door", "points": [
      { "time_s": 0, "yaw_deg": 170 }, { "time_s": 1, "yaw_deg": -170 } ] }])");
  ASSERT_TRUE(script.ok());
  DoorStage stage;
  const double half_deg = angle_deg(stage.pose(*script, 0.5).rotation);
  EXPECT_NEAR(std::remainder(half_deg - 210, 360), 0, 1e-3);
}

TEST(PartScript, AddsBoxes) {
  auto script = parsed(R"([{ "name": "crate", "box_m": [1, 2, 3], "transmission": 0.25, "points": [
      { "time_s": 0, "position_m": [0, 0.5, 3] }, { "time_s": 2, "position_m": [2, 0.5, 3] } ] }])");
  ASSERT_TRUE(script.ok()) << script.error().message;
  EXPECT_TRUE(script->adds_parts());
  DoorStage stage;
  ASSERT_TRUE(script->check({}).ok());
  EXPECT_EQ(stage.pose(*script, 1, 1).position_m, Vec3(1, 0.5, 3));
  EXPECT_EQ(stage.pose(*script, 2, 1).position_m, Vec3(2, 0.5, 3));
  EXPECT_EQ(stage.parts.size(), 2u);
  const PartShape& shape = *stage.parts.parts()[1].shape;
  EXPECT_EQ(shape.bounds().high_m - shape.bounds().low_m, Vec3f(1, 2, 3));
  EXPECT_EQ(shape.transmission(0), same_in_all_bands(0.25f));
}

TEST(PartScript, NamesThePartThatTheLevelLacks) {
  const auto script = parsed(R"([{ "name": "Dor", "points": [{ "time_s": 0 }] }])");
  ASSERT_TRUE(script.ok());
  const auto none = script->check({});
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("'Dor'"), std::string::npos) << none.error().message;
  const std::vector<MovablePart> level{door(0)};
  const auto other = script->check(level);
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("'Door'"), std::string::npos) << other.error().message;
}

TEST(PartScript, RefusesWhatItCannotMove) {
  for (
      const char* text :
      {R"({})", R"([])", R"([3])", R"([{}])", R"([{ "name": "Door" }])",
       R"([{ "name": "Door", "points": [] }])", R"([{ "name": "Door", "points": [{}] }])",
       R"([{ "name": "Door", "points": [{ "time_s": 1 }, { "time_s": 0.5 }] }])",
       R"([{ "name": "Door", "points": [{ "time_s": 0, "position_m": [1e30, 0, 0] }] }])",
       R"([{ "name": "Door", "points": [{ "time_s": 0, "yaw_deg": 1e30 }] }])",
       R"([{ "name": "Door", "points": [{ "time_s": 0, "scale": 0 }] }])",
       R"([{ "name": "Door", "transmission": 1, "points": [{ "time_s": 0 }] }])",
       R"([{ "name": "crate", "box_m": [1, 1, 1], "points": [{ "time_s": 0 }] }])",
       R"([{ "name": "crate", "box_m": [1, 0, 1], "points": [{ "time_s": 0, "position_m": [0, 0, 0] }] }])",
       R"([{ "name": "crate", "box_m": [1, 1, 1], "transmission": 2, "points": [{ "time_s": 0, "position_m": [0, 0, 0] }] }])"})
    EXPECT_FALSE(parsed(text).ok()) << text;
}

TEST(PartScript, MayBeAllThatAMovingScriptHas) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("clamor_parts_" + std::to_string(::getpid())))
          .string();
  std::ofstream(path) << R"({ "parts": [{ "name": "Door", "points": [{ "time_s": 0 }] }] })";
  const auto script = MovingScript::read(path);
  std::ofstream(path) << R"({ "comment": "nothing" })";
  EXPECT_FALSE(MovingScript::read(path).ok());
  std::filesystem::remove(path);
  ASSERT_TRUE(script.ok()) << script.error().message;
  EXPECT_FALSE(script->parts().empty());
  EXPECT_EQ(script->options(0).max_sources, 0u);
}

}  // namespace
}  // namespace clamor
