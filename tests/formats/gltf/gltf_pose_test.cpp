#include <gmock/gmock.h>

#include "tests/formats/box_level.h"

namespace clamor::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

class Pose : public BoxLevelTest {
 protected:
  // A triangle in centimetres, skinned to the hips of an armature that is scaled and moved.
  void avatar() {
    triangle();
    json& attributes = level_["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = accessor(view(raw(std::vector<std::uint8_t>(12, 0))), 5121, 3, "VEC4");
    std::vector<float> weights;
    for (int i = 0; i < 3; ++i) weights.insert(weights.end(), {1, 0, 0, 0});
    attributes["WEIGHTS_0"] = floats(weights, "VEC4", 4);
    const std::vector<float> bind = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -50, 0, 0, 1};
    level_["skins"] = {{{"joints", {1}}, {"inverseBindMatrices", floats(bind, "MAT4", 16)}}};
    level_["nodes"][0].update({{"skin", 0}, {"translation", {7, 7, 7}}});
    node({{"name", "Hips"}});
    node({{"name", "Armature"},
          {"translation", {3, 0, 2}},
          {"scale", {0.01, 0.01, 0.01}},
          {"children", {1}}});
    level_["scenes"] = {{{"nodes", {0}}}};  // joints need not be in the scene
  }
};

// glTF 2.0: joint x inverse bind matrix x vertex, without the transform of the skinned node.
TEST_F(Pose, OfASkinIsWhereItsJointsRest) {
  avatar();
  const Mesh mesh = level().mesh;
  ASSERT_EQ(mesh.triangles.size(), 1u);
  const auto& [a, b, c] = mesh.triangles[0];
  EXPECT_NEAR(mesh.vertices_m[a].x, 3 - 0.5, 1e-6);
  EXPECT_NEAR(mesh.vertices_m[b].x, 3 - 0.49, 1e-6);
  EXPECT_NEAR(mesh.vertices_m[c].y, 0.01, 1e-6);
  EXPECT_NEAR(mesh.vertices_m[c].z, 2, 1e-6);
  EXPECT_THAT(import()->report.found,
              Contains(HasSubstr("1 skinned mesh where the skin's joints rest: 'Thing'")));
  EXPECT_EQ(level({.ignored = {"Thing"}}).mesh.triangles.size(), 0u);
}

TEST_F(Pose, OfADamagedSkinLeavesTheMeshOutAndSaysWhy) {
  avatar();
  level_["skins"][0]["joints"] = {9};
  EXPECT_EQ(level().mesh.triangles.size(), 0u);
  EXPECT_THAT(import()->report.warnings, Contains(HasSubstr("a joint that is no node")));
  level_["skins"][0] = {{"joints", {1, 1}}, {"inverseBindMatrices", 0}};
  EXPECT_THAT(import()->report.warnings, Contains(HasSubstr("'Thing'")));
  level_["nodes"][0]["skin"] = 5;
  EXPECT_THAT(import()->report.warnings, Contains(HasSubstr("its skin does not exist")));
}

TEST_F(Pose, OfShapeKeysIsThatOfTheirDefaultWeights) {
  triangle();
  json& shape = level_["meshes"][0];
  shape["primitives"][0]["targets"] = {{{"POSITION", floats({0, 3, 0, 0, 3, 0, 0, 3, 0})}},
                                       {{"POSITION", floats({1, 0, 0, 1, 0, 0, 1, 0, 0})}}};
  const auto first = [&] { return level().mesh.vertices_m.at(0); };
  EXPECT_EQ(first(), Vec3f(0, 0, 0)) << "weights are 0 unless something says so";
  shape["weights"] = {1, 0.5};
  EXPECT_EQ(first(), Vec3f(0.5f, 3, 0));
  EXPECT_THAT(import()->report.found, Contains(HasSubstr("shape keys: 'Thing'")));
  level_["nodes"][0]["weights"] = {0, 2};
  EXPECT_EQ(first(), Vec3f(2, 0, 0)) << "those of the node count";
}

TEST_F(Pose, OfTwoNodesOfOneMeshDiffers) {
  triangle();
  level_["meshes"][0]["primitives"][0]["targets"] = {
      {{"POSITION", floats({0, 3, 0, 0, 3, 0, 0, 3, 0})}}};
  node({{"mesh", 0}, {"name", "Raised"}, {"weights", {1}}});
  const Mesh mesh = level().mesh;
  ASSERT_EQ(mesh.vertices_m.size(), 6u);
  EXPECT_EQ(mesh.vertices_m[0].y, 0);
  EXPECT_EQ(mesh.vertices_m[3].y, 3);
}

}  // namespace
}  // namespace clamor::testing
