// gltf_movable_test.cpp: nodes of a level that are movable parts.
#include <gmock/gmock.h>

#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

class Movable : public LevelTest {
 protected:
  // A triangle on node 0, which stays, and one on node 1.
  void two_triangles() {
    triangle();
    level_["materials"] = {{{"name", "brick"}}, {{"name", "glass"}}};
    level_["meshes"][0]["primitives"][0]["material"] = 0;
    mesh({{"attributes", {{"POSITION", positions_}}}, {"material", 1}});
    node({{"mesh", 1}, {"name", "Door_Left"}, {"extras", {{"clamor", {{"movable", true}}}}}});
  }
  static Vec3f placed_corner(const MovablePart& part, std::size_t c) {
    const Mesh mesh = placed(part.mesh, part.rest_pose);
    return mesh.vertices_m[mesh.triangles[0][c]];
  }
};

TEST_F(Movable, IsAPartThatIsNotInTheMesh) {
  two_triangles();
  const double half = std::sqrt(0.5);
  level_["nodes"][1].update({{"translation", {10, 0, 0}},
                             {"rotation", {0, 0, half, half}},  // 90 degrees about z
                             {"scale", {2, -3, 1}}});
  const Level result = level();
  EXPECT_EQ(result.mesh.triangles.size(), 1u);
  ASSERT_EQ(result.movable_parts.size(), 1u);
  const MovablePart& door = result.movable_parts[0];
  EXPECT_EQ(door.name, "Door_Left");
  EXPECT_EQ(door.rest_pose.position_m, Vec3(10, 0, 0));
  EXPECT_EQ(door.rest_pose.scale, 1);
  // The mesh has the scale, the pose the rest.
  EXPECT_LT(glm::length(door.mesh.vertices_m[door.mesh.triangles[0][1]] - Vec3f(2, 0, 0)), 1e-6);
  EXPECT_LT(glm::length(placed_corner(door, 1) - Vec3f(10, 2, 0)), 1e-6);
  EXPECT_LT(glm::length(placed_corner(door, 2) - Vec3f(13, 0, 0)), 1e-6);
  // The material of a part counts as that of any other node.
  ASSERT_EQ(result.materials.size(), 2u);
  EXPECT_EQ(result.materials[door.mesh.materials[0]].name, "glass");
  EXPECT_EQ(result.materials[result.mesh.materials[0]].name, "brick");
}

TEST_F(Movable, HasTheMeshesOfItsChildren) {
  two_triangles();
  level_["nodes"][1].erase("mesh");
  level_["nodes"][1].update({{"children", {2}}, {"translation", {0, 1, 0}}});
  node({{"mesh", 1},
        {"name", "Handle"},
        {"translation", {0, 0, 5}},
        {"extras", {{"clamor", {{"movable", true}}}}}});
  const Level result = level();
  ASSERT_EQ(result.movable_parts.size(), 1u);
  EXPECT_EQ(result.movable_parts[0].name, "Door_Left");
  EXPECT_EQ(result.movable_parts[0].rest_pose.position_m, Vec3(0, 1, 0));
  EXPECT_LT(glm::length(placed_corner(result.movable_parts[0], 1) - Vec3f(1, 1, 5)), 1e-6);
}

TEST_F(Movable, IsNamedByTheSidecarToo) {
  two_triangles();
  level_["nodes"][1].erase("extras");
  EXPECT_TRUE(level().movable_parts.empty());
  write("level.acoustics.json", R"({"movable": ["door_*", "Gate*"]})");
  const auto imported = import();
  ASSERT_TRUE(imported.ok());
  ASSERT_EQ(imported->level.movable_parts.size(), 1u);
  EXPECT_THAT(imported->report.warnings, ::testing::Contains(HasSubstr("'Gate*' matches no node")));
  EXPECT_THAT(imported->report.found, ::testing::Contains(HasSubstr("1 movable part with 1 tri")));
  write("level.acoustics.json", R"({"movable": [3]})");
  EXPECT_THAT(refusal(), HasSubstr("'movable' must be a list of patterns"));
  write("level.acoustics.json", R"({"movable": "Door"})");
  EXPECT_THAT(refusal(), HasSubstr("'movable' must be a list of patterns"));
}

TEST_F(Movable, WithoutTrianglesIsLeftOutWithAWarning) {
  two_triangles();
  level_["nodes"][1].erase("mesh");
  const auto imported = import();
  ASSERT_TRUE(imported.ok());
  EXPECT_TRUE(imported->level.movable_parts.empty());
  EXPECT_THAT(imported->report.warnings, ::testing::Contains(HasSubstr("'Door_Left' has no tri")));
}

TEST_F(Movable, RefusesAMarkThatIsNeitherTrueNorFalse) {
  two_triangles();
  level_["nodes"][1]["extras"]["clamor"]["movable"] = "yes";
  EXPECT_THAT(refusal(), HasSubstr("must be true or false"));
  level_["nodes"][1]["extras"]["clamor"]["movable"] = false;
  EXPECT_TRUE(level().movable_parts.empty());
  level_["nodes"][1]["extras"]["clamor"] = 7;
  EXPECT_THAT(refusal(), HasSubstr("must be an object"));
}

TEST_F(Movable, ScaledToNothingIsFlatOrLeftOutButNoCrash) {
  two_triangles();
  level_["nodes"][1]["scale"] = {0, 0, 0};
  EXPECT_TRUE(level().movable_parts.empty());
  level_["nodes"][1]["scale"] = {1, 1, 0};
  EXPECT_EQ(level().movable_parts.size(), 1u);
  level_["nodes"][1]["scale"] = {1, 1, 1};
  level_["nodes"][1]["translation"] = {1e30, 0, 0};
  EXPECT_FALSE(import().ok());
  level_["nodes"][1]["translation"] = {2e6, 0, 0};
  EXPECT_FALSE(import().ok());
}

// Quantised positions in a node mean that its transform unpacks them, and no longer is a hinge.
TEST_F(Movable, IsWarnedOfWhereAQuantiserMovedItsPivot) {
  two_triangles();
  const auto warnings = [&] { return import()->report.warnings; };
  EXPECT_THAT(warnings(), ::testing::Not(::testing::Contains(HasSubstr("quantises"))));
  const std::vector<std::int16_t> corners = {-32767, 0, 0, 0, 32767, 0, 0, 0, 32767, -32767, 0, 0};
  level_["meshes"][1]["primitives"][0]["attributes"]["POSITION"] =
      accessor(view(raw(corners), 8), 5122, 3, "VEC3", {{"normalized", true}});
  level_["nodes"][1]["translation"] = {3, 1, 0};
  EXPECT_THAT(warnings(), ::testing::Contains(HasSubstr(
                              "the movable part 'Door_Left' turns about (3, 1, 0), where a tool")));
  // The mark of a node above is not touched.
  level_["nodes"][1].erase("extras");
  node({{"name", "Hinge"}, {"children", {1}}, {"extras", {{"clamor", {{"movable", true}}}}}});
  EXPECT_THAT(warnings(), ::testing::Not(::testing::Contains(HasSubstr("quantises"))));
}

TEST_F(Movable, IsWarnedOfAPivotInTheMiddleOfAMeshThatAQuantiserUnpacked) {
  two_triangles();
  level_["meshes"][1]["primitives"][0]["attributes"]["POSITION"] =
      floats({-1, -1, 0, 1, -1, 0, 1, 1, 0});
  const auto warnings = [&] { return import()->report.warnings; };
  EXPECT_THAT(warnings(), ::testing::Not(::testing::Contains(HasSubstr("quantises"))));
  level_["asset"]["generator"] = "glTF-Transform v4.5.1";
  EXPECT_THAT(warnings(), ::testing::Contains(HasSubstr("quantises")));
}

}  // namespace
}  // namespace clamor::testing
