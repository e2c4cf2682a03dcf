#include <gmock/gmock.h>

#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

Vec3f corner(const Level& level, std::size_t t, std::size_t c) {
  return level.mesh.vertices_m[level.mesh.triangles[t][c]];
}

class Geometry : public LevelTest {};

TEST_F(Geometry, IsScaledRotatedAndTranslatedByItsNode) {
  triangle();
  const double half = std::sqrt(0.5);
  level_["nodes"][0].update({{"translation", {10, 0, 0}},
                             {"rotation", {0, 0, half, half}},  // 90 degrees about z
                             {"scale", {2, -3, 1}}});
  const Level result = level();
  // (1, 0, 0) -> (2, 0, 0) -> (0, 2, 0) -> (10, 2, 0); (0, 1, 0) -> (0, -3, 0) -> (3, 0, 0) -> 13.
  EXPECT_LT(glm::length(corner(result, 0, 1) - Vec3f(10, 2, 0)), 1e-6);
  EXPECT_LT(glm::length(corner(result, 0, 2) - Vec3f(13, 0, 0)), 1e-6);
}

TEST_F(Geometry, FollowsTheHierarchyAndColumnMajorMatrices) {
  triangle();
  level_["nodes"][0]["translation"] = {0, 1, 0};
  node({{"children", {0}}, {"matrix", {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 6, 7, 1}}});
  EXPECT_EQ(corner(level(), 0, 1), Vec3f(7, 8, 7));
}

TEST_F(Geometry, IsTheSameWhateverTheTypeOfItsIndices) {
  const std::vector<std::uint8_t> indices = {0, 1, 2, 2, 1, 3};
  positions_ = floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  const std::vector<std::uint16_t> words(indices.begin(), indices.end());
  const std::vector<std::uint32_t> longs(indices.begin(), indices.end());
  const int types[] = {accessor(view(raw(indices)), 5121, 6, "SCALAR"),
                       accessor(view(raw(words)), 5123, 6, "SCALAR"),
                       accessor(view(raw(longs)), 5125, 6, "SCALAR")};
  mesh({{"attributes", {{"POSITION", positions_}}}});
  node({{"mesh", 0}});
  for (const int type : types) {
    level_["meshes"][0]["primitives"][0]["indices"] = type;
    const Level result = level();
    ASSERT_EQ(result.mesh.triangles.size(), 2u);
    EXPECT_EQ(corner(result, 1, 0), Vec3f(0, 1, 0));
    EXPECT_EQ(corner(result, 1, 2), Vec3f(1, 1, 0));
    EXPECT_EQ(result.mesh.vertices_m.size(), 4u);
  }
}

TEST_F(Geometry, OfStripsAndFansIsTheSameSurface) {
  positions_ = floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0});
  mesh({{"attributes", {{"POSITION", positions_}}}, {"mode", 5}});
  node({{"mesh", 0}});
  const Level strip = level();
  ASSERT_EQ(strip.mesh.triangles.size(), 3u);
  for (std::size_t t = 0; t < 3; ++t) {
    const Vec3f a = corner(strip, t, 0);
    const Vec3f normal = glm::cross(corner(strip, t, 1) - a, corner(strip, t, 2) - a);
    EXPECT_GT(normal.z, 0) << "triangle " << t << " faces the other way";
  }
  level_["meshes"][0]["primitives"][0]["mode"] = 6;
  const Level fan = level();
  // Triangles 0 1 2, 0 2 3 and 0 3 4 share vertex 0.
  ASSERT_EQ(fan.mesh.triangles.size(), 3u);
  for (std::size_t t = 0; t < 3; ++t) EXPECT_EQ(corner(fan, t, 0), Vec3f(0, 0, 0));
}

TEST_F(Geometry, ReportsSkippedPointsAndLines) {
  triangle();
  mesh({{"attributes", {{"POSITION", positions_}}}, {"mode", 1}});
  node({{"mesh", 1}});
  const auto imported = import();
  ASSERT_TRUE(imported.ok());
  EXPECT_EQ(imported->level.mesh.triangles.size(), 1u);
  EXPECT_THAT(imported->report.ignored, ::testing::Contains(HasSubstr("points or lines")));
}

TEST_F(Geometry, ReadsEveryQuantisedType) {
  const std::vector<std::int8_t> bytes = {0, 0, 0, 0, 127, 0, 0, 0, 0, -128, 0, 0};  // stride 4
  const std::vector<std::uint16_t> words = {0, 0, 0, 0, 65535, 0, 0, 0, 0, 65535, 0, 0};
  const std::vector<std::int16_t> shorts = {0, 0, 0, 0, 300, 0, 0, 0, 0, 5, 0, 0};
  const int normal = accessor(view(raw(bytes), 4), 5120, 3, "VEC3", {{"normalized", true}});
  const int unit = accessor(view(raw(words), 8), 5123, 3, "VEC3", {{"normalized", true}});
  const int plain = accessor(view(raw(shorts), 8), 5122, 3, "VEC3");
  level_["extensionsRequired"] = {"KHR_mesh_quantization"};
  mesh({{"attributes", {{"POSITION", normal}}}});
  node({{"mesh", 0}});
  json& position = level_["meshes"][0]["primitives"][0]["attributes"]["POSITION"];
  EXPECT_EQ(corner(level(), 0, 2), Vec3f(0, -1, 0));  // -128 / 127 is clamped to -1
  position = unit;
  EXPECT_EQ(corner(level(), 0, 1), Vec3f(1, 0, 0));
  position = plain;
  EXPECT_EQ(corner(level(), 0, 1), Vec3f(300, 0, 0));
}

TEST_F(Geometry, KnowsHowFarRoundingToIntegersPartsVertices) {
  const std::vector<std::int16_t> shorts = {0, 0, 0, 0, 32767, 0, 12347, 0, 0, 32767, 0, 0};
  // 2550 of 8191 steps, whose highest bit is repeated.
  const std::vector<std::int16_t> fewer = {0, 0, 0, 0, 32767, 0, -10201, 0, 0, 32767, 0, 0};
  const json normalized = {{"normalized", true}};
  const int normal = accessor(view(raw(shorts), 8), 5122, 3, "VEC3", normalized);
  const int of_14_bits = accessor(view(raw(fewer), 8), 5122, 3, "VEC3", normalized);
  const int plain = accessor(view(raw(shorts), 8), 5122, 3, "VEC3");
  level_["extensionsRequired"] = {"KHR_mesh_quantization"};
  mesh({{"attributes", {{"POSITION", normal}}}});
  node({{"mesh", 0}, {"scale", {2, 3, 6}}});
  const auto rounding_m = [this] {
    const auto imported = import();
    EXPECT_TRUE(imported.ok());
    return imported.ok() ? imported->rounding_m : -1;
  };
  json& position = level_["meshes"][0]["primitives"][0]["attributes"]["POSITION"];
  EXPECT_NEAR(rounding_m(), 7 / 32767.0, 1e-12);
  position = of_14_bits;
  EXPECT_NEAR(rounding_m(), 7 / 8191.0, 1e-12);
  position = plain;
  EXPECT_NEAR(rounding_m(), 7, 1e-9);
  position = floats({0, 0, 0, 1, 0, 0, 0, 1, 0});
  EXPECT_EQ(rounding_m(), 0);
}

TEST_F(Geometry, TakesSparseValuesOverAndWithoutABuffer) {
  const int indices = view(raw(std::vector<std::uint16_t>{1, 2}));
  const int values = view(raw(std::vector<float>{4, 0, 0, 0, 5, 0}));
  const json sparse = {{"sparse",
                        {{"count", 2},
                         {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                         {"values", {{"bufferView", values}}}}}};
  const int base = view(raw(std::vector<float>{1, 1, 1, 1, 0, 0, 0, 1, 0}));
  mesh({{"attributes", {{"POSITION", accessor(base, 5126, 3, "VEC3", sparse)}}}});
  node({{"mesh", 0}});
  EXPECT_EQ(corner(level(), 0, 0), Vec3f(1, 1, 1));
  EXPECT_EQ(corner(level(), 0, 1), Vec3f(4, 0, 0));
  level_["accessors"][0].erase("bufferView");
  EXPECT_EQ(corner(level(), 0, 0), Vec3f(0, 0, 0));
  EXPECT_EQ(corner(level(), 0, 2), Vec3f(0, 5, 0));
}

TEST_F(Geometry, IsRepeatedAtEveryInstance) {
  triangle();
  const int moves = floats({0, 0, 1, 0, 0, 2, 0, 0, 3});
  const int scales = floats({1, 1, 1, 2, 2, 2, 3, 3, 3});
  level_["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", moves}, {"SCALE", scales}};
  level_["nodes"][0]["translation"] = {100, 0, 0};
  const Level result = level();
  ASSERT_EQ(result.mesh.triangles.size(), 3u);
  EXPECT_EQ(corner(result, 2, 1), Vec3f(103, 0, 3));
}

TEST_F(Geometry, HiddenByAnAncestorIsSkippedUnlessRequested) {
  triangle();
  node({{"children", {0}}, {"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}});
  EXPECT_TRUE(level().mesh.triangles.empty());
  EXPECT_EQ(level({.hidden_meshes = true}).mesh.triangles.size(), 1u);
}

TEST_F(Geometry, OfNodesOutsideTheSceneIsSkipped) {
  triangle();
  node({{"mesh", 0}});
  level_["scenes"] = {{{"nodes", {1}}}};
  EXPECT_EQ(level().mesh.triangles.size(), 1u);
}

TEST_F(Geometry, WithoutAreaIsSkipped) {
  positions_ = floats({0, 0, 0, 1, 0, 0, 2, 0, 0});
  mesh({{"attributes", {{"POSITION", positions_}}}});
  node({{"mesh", 0}});
  const auto imported = import();
  ASSERT_TRUE(imported.ok());
  EXPECT_TRUE(imported->level.mesh.triangles.empty());
}

TEST_F(Geometry, DoesNotNeedItsTextures) {
  triangle();
  level_["images"] = {{{"uri", "missing.png"}}, {{"bufferView", 99}, {"mimeType", "image/ktx2"}}};
  level_["textures"] = {{{"source", 7}}};
  EXPECT_EQ(level().mesh.triangles.size(), 1u);
}

TEST_F(Geometry, IsEqualInBinaryAndTextFiles) {
  triangle();
  const Level text = level();
  json document = level_;
  document["buffers"] = {{{"byteLength", bin_.size()}}};
  const auto binary = import_level(write("level.glb", glb(document, bin_)), {});
  ASSERT_TRUE(binary.ok()) << binary.error().message;
  EXPECT_EQ(binary->level.mesh, text.mesh);
}

TEST_F(Geometry, InAHierarchyOfDepth100000IsFound_NoAsan) {
  triangle();
  for (int i = 1; i < 100000; ++i) node({{"children", {i - 1}}, {"translation", {0.001, 0, 0}}});
  EXPECT_NEAR(corner(level(), 0, 0).x, 99.999, 1e-3);
}

}  // namespace
}  // namespace clamor::testing
