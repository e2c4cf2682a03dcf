#include "formats/level/walk_file.h"

#include <gmock/gmock.h>

#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

class Walks : public LevelTest {
 protected:
  Result<Walk> walk(const std::string& text) const { return Walk::read(write("walk.json", text)); }
};

TEST_F(Walks, InterpolateLinearlyAndTurnAlongTheShorterArc) {
  const auto result = walk(R"({"points": [
      {"time_s": 1, "position_m": [0, 1, 0], "yaw_deg": 170},
      {"time_s": 3, "position_m": [4, 1, 0], "yaw_deg": -170, "pitch_deg": 20}]})");
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->at(0).position_m, Vec3(0, 1, 0));
  EXPECT_EQ(result->at(2).position_m, Vec3(2, 1, 0));
  const Orientation half_way(HeadAngles{M_PI, 10 * M_PI / 180});
  EXPECT_NEAR(length(result->at(2).forward() - half_way.forward()), 0, 1e-12);
  EXPECT_NEAR(length(result->at(2).right() - half_way.right()), 0, 1e-12);
  EXPECT_EQ(result->at(99).position_m, Vec3(4, 1, 0));
  EXPECT_EQ(result->length_s(), 3);
}

TEST_F(Walks, RollTheHeadAlongTheShorterArc) {
  const auto result = walk(R"({"points": [
      {"time_s": 0, "position_m": [0, 1, 0], "roll_deg": 170},
      {"time_s": 2, "position_m": [0, 1, 0], "roll_deg": -170}]})");
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_NEAR(length(result->at(1).up() - Vec3(0, -1, 0)), 0, 1e-12) << "upside down";
  EXPECT_NEAR(length(result->at(1).right() - Vec3(-1, 0, 0)), 0, 1e-12);
  EXPECT_NEAR(length(result->at(1).forward() - Vec3(0, 0, -1)), 0, 1e-12);
}

TEST_F(Walks, JumpWhereTwoPointsHaveOneTime) {
  const auto result = walk(R"({"points": [
      {"time_s": 0, "position_m": [0, 0, 0]}, {"time_s": 2, "position_m": [2, 0, 0]},
      {"time_s": 2, "position_m": [9, 0, 0]}, {"time_s": 3, "position_m": [8, 0, 0]}]})");
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_NEAR(result->at(1.999).position_m.x, 1.999, 1e-12);
  EXPECT_EQ(result->at(2).position_m.x, 9);
  EXPECT_NEAR(result->at(2.5).position_m.x, 8.5, 1e-12);
}

TEST_F(Walks, RestartIfTheyLoop) {
  const auto result = walk(R"({"loop": true, "points": [
      {"time_s": 0, "position_m": [0, 0, 0]}, {"time_s": 2, "position_m": [2, 0, 0]}]})");
  ASSERT_TRUE(result.ok());
  EXPECT_NEAR(result->at(5).position_m.x, 1, 1e-12);
}

TEST_F(Walks, NameTheInvalidPoint) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "is empty"},
      {"{}", "points"},
      {R"({"points": []})", "points"},
      {R"({"points": [{"position_m": [0, 0, 0]}]})", "time_s"},
      {R"({"points": [{"time_s": 0}]})", "position_m"},
      {R"({"points": [{"time_s": 0, "position_m": [0, 0]}]})", "three numbers"},
      {R"({"points": [{"time_s": 0, "position_m": [0, 0, 0], "yaw": 1}]})", "'yaw_deg'"},
      {R"({"points": [{"time_s": 1, "position_m": [0, 0, 0]}, {"time_s": 0.9, "position_m": [0, 0, 0]}]})",
       "point 2"}};
  for (const auto& [text, part] : cases) {
    const auto result = walk(text);
    ASSERT_FALSE(result.ok()) << text;
    EXPECT_THAT(result.error().message,
                ::testing::AllOf(::testing::HasSubstr("walk.json"), ::testing::HasSubstr(part)));
  }
}

}  // namespace
}  // namespace clamor::testing
