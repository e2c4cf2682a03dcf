#include <gmock/gmock.h>

#include "tests/formats/box_level.h"

namespace clamor::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class Surfaces : public BoxLevelTest {};

TEST_F(Surfaces, DoNotIncludeCollisionHullsAndSaySo) {
  box("Walls");
  box("UCX_Walls");
  box("UCX_Walls_01");
  EXPECT_EQ(boxes(), 1u);
  EXPECT_THAT(import()->report.ignored,
              Contains("2 collision hulls: 'UCX_Walls', 'UCX_Walls_01'; --keep NAME makes one a "
                       "surface"));
  EXPECT_EQ(boxes({.kept = {"ucx_walls"}}), 2u);
}

TEST_F(Surfaces, AreNamedByTheMeshAsWellAndAboveTheirNode) {
  box("Walls");
  node({{"name", "Thing"}, {"mesh", box_mesh({0, 0, 0}, {1, 1, 1}, "UBX_Thing")}});
  const int part = box("Part");
  node({{"name", "Stairs-colonly"}, {"children", {part}}});
  level_["scenes"] = {{{"nodes", {0, 1, 3}}}};
  EXPECT_EQ(boxes(), 1u);
  EXPECT_EQ(boxes({.kept = {"Part"}}), 2u);
}

TEST_F(Surfaces, AreLeftOutByPatternsOfSidecarAndCommandLine) {
  box("Walls");
  box("Ghost_1");
  box("Ghost_2");
  EXPECT_EQ(boxes({.ignored = {"ghost_*"}}), 1u);
  write("level.acoustics.json", R"({"ignored": ["Ghost_*"]})");
  EXPECT_EQ(boxes(), 1u);
  EXPECT_THAT(import()->report.ignored, Contains("2 meshes to be ignored: 'Ghost_1', 'Ghost_2'"));
  EXPECT_EQ(boxes({.kept = {"Ghost_2"}}), 2u);
  write("level.acoustics.json", R"({"ignored": ["Gost_*"]})");
  EXPECT_THAT(import()->report.warnings, Contains(HasSubstr("'Gost_*'")));
  write("level.acoustics.json", R"({"ignored": "Ghost_*"})");
  EXPECT_THAT(refusal(), HasSubstr("'ignored' must be a list of patterns"));
}

TEST_F(Surfaces, AreHiddenByEveryWordForIt) {
  box("Walls");
  const int hidden = box("Hidden");
  const auto is_hidden = [&](json changes) {
    json& target = level_["nodes"][static_cast<std::size_t>(hidden)];
    target.erase("extras");
    target.erase("extensions");
    target.update(changes);
    return boxes() == 1 && boxes({.hidden_meshes = true}) == 2;
  };
  EXPECT_TRUE(is_hidden({{"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}}));
  EXPECT_TRUE(is_hidden({{"extras", {{"visible", false}}}}));
  EXPECT_TRUE(is_hidden({{"extras", {{"visible", 0}}}}));
  EXPECT_TRUE(
      is_hidden({{"extensions", {{"MOZ_hubs_components", {{"visible", {{"visible", false}}}}}}}}));
  EXPECT_FALSE(is_hidden({{"extras", {{"visible", true}}}}));
}

TEST_F(Surfaces, DoNotIncludeSkiesByNodeMeshOrMaterial) {
  box("Walls");
  box("SkyDome", {-60, -60, -60}, {60, 60, 60});
  box("Cylinder", {-70, -60, -70}, {70, 60, 70}, material({{"name", "M_Sky"}}));
  node({{"name", "Sphere"}, {"mesh", box_mesh({-9, -9, -9}, {9, 9, 9}, "skybox")}});
  EXPECT_EQ(boxes(), 1u);
  EXPECT_THAT(import()->report.ignored,
              Contains(HasSubstr("3 skies: 'SkyDome', 'Sphere', 'M_Sky'")));
  EXPECT_EQ(boxes({.kept = {"M_Sky"}}), 2u);
}

// Without a name: an unlit sphere round a lit level.
TEST_F(Surfaces, DoNotIncludeAnUnlitShellRoundEverything) {
  box("Ground", {-40, -1, -40}, {40, 0, 40});
  std::vector<float> positions;
  std::vector<std::uint16_t> indices;
  constexpr int kRings = 6, kSides = 10;
  for (int ring = 0; ring <= kRings; ++ring)
    for (int side = 0; side < kSides; ++side) {
      const double polar = 3.14159265 * ring / kRings, turn = 6.2831853 * side / kSides;
      for (const double value :
           {std::sin(polar) * std::cos(turn), std::cos(polar), std::sin(polar) * std::sin(turn)})
        positions.push_back(static_cast<float>(70 * value));
      if (ring == kRings) continue;
      const int corner = ring * kSides + side, next = ring * kSides + (side + 1) % kSides;
      for (const int index : {corner, next, corner + kSides, next, next + kSides, corner + kSides})
        indices.push_back(static_cast<std::uint16_t>(index));
    }
  const int unlit = material({{"name", "Far"}});
  const int sphere =
      mesh({{"attributes", {{"POSITION", floats(positions)}}},
            {"indices", accessor(view(raw(indices)), 5123, indices.size(), "SCALAR")},
            {"material", unlit}});
  node({{"name", "Sphere.001"}, {"mesh", sphere}});
  EXPECT_GT(level().mesh.triangles.size(), 12u);
  level_["materials"][0]["extensions"] = {{"KHR_materials_unlit", json::object()}};
  EXPECT_EQ(level().mesh.triangles.size(), 12u);
  EXPECT_THAT(import()->report.ignored, Contains(HasSubstr("1 sky: 'Sphere.001'")));
  EXPECT_GT(level({.kept = {"Sphere*"}}).mesh.triangles.size(), 12u);
}

// Levels with baked light are unlit, walls and all.
TEST_F(Surfaces, IncludeUnlitWalls) {
  const json unlit = {{"KHR_materials_unlit", json::object()}};
  box("Walls", {0, 0, 0}, {9, 3, 9}, material({{"name", "a"}, {"extensions", unlit}}));
  box("Table", {2, 0, 2}, {7, 1, 7}, material({{"name", "b"}}));
  EXPECT_EQ(boxes(), 2u) << "a box is a sky only if it is much larger than all else";
  level_["materials"][1]["extensions"] = unlit;
  EXPECT_EQ(boxes(), 2u);
}

TEST_F(Surfaces, DoNotIncludeMaterialsThatAreFullyTransparent) {
  const json clear = {{"baseColorFactor", {1, 1, 1, 0}}};
  box("Walls");
  box("Ghost", {0, 0, 0}, {1, 1, 1},
      material({{"name", "Clear"}, {"alphaMode", "BLEND"}, {"pbrMetallicRoughness", clear}}));
  box("Opaque", {0, 0, 0}, {1, 1, 1},
      material({{"name", "Opaque"}, {"pbrMetallicRoughness", clear}}));
  EXPECT_EQ(boxes(), 2u) << "an opaque material ignores alpha";
  EXPECT_THAT(import()->report.ignored, Contains(HasSubstr("fully transparent material: 'Clear'")));
  EXPECT_EQ(boxes({.kept = {"Clear"}}), 3u);
}

TEST_F(Surfaces, DoNotIncludeLowerDetailsThatAnExtensionLists) {
  box("Walls");
  box("Coarse");
  level_["nodes"][0]["extensions"] = {{"MSFT_lod", {{"ids", {1}}}}};
  EXPECT_EQ(boxes(), 1u);
  EXPECT_THAT(import()->report.ignored, Contains(HasSubstr("lower level of detail: 'Coarse'")));
}

// A level may be drawn by its colliders alone; nothing would be left of it.
TEST_F(Surfaces, IncludeEverythingWhereAllNamesAreThoseOfHelpers) {
  box("Level-colonly");
  EXPECT_EQ(boxes(), 1u);
  EXPECT_THAT(import()->report.warnings,
              Contains(HasSubstr("'Level-colonly' has that of a collision hull")));
  box("Level-col");
  EXPECT_EQ(boxes(), 1u);
  EXPECT_THAT(import()->report.found, Contains(HasSubstr("'Level-col' is a surface")));
}

TEST_F(Surfaces, KeepEmittersOfWhatIsLeftOut) {
  box("Walls");
  box("UCX_Walls");
  level_["nodes"][1]["extensions"] = {{"KHR_audio_emitter", {{"emitter", 0}}}};
  level_["extensions"]["KHR_audio_emitter"] = {
      {"audio", {{{"uri", "a.wav"}}}},
      {"sources", {{{"audio", 0}}}},
      {"emitters", {{{"type", "positional"}, {"sources", {0}}}}}};
  write("a.wav", wav());
  EXPECT_EQ(level().emitters.size(), 1u);
  EXPECT_EQ(boxes(), 1u);
}

}  // namespace
}  // namespace clamor::testing
