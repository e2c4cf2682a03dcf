// Levels that tools have written: what these moved is read, and what they lost is said.
#include <filesystem>

#include <gmock/gmock.h>

#include "tests/build_paths.h"
#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class ToolLosses : public LevelTest {
 protected:
  // A level of one triangle for each material.
  std::vector<std::string> warnings(const std::string& generator, const json& materials,
                                    const char* node_name = "Room") {
    level_ = {{"asset", {{"version", "2.0"}, {"generator", generator}}}};
    bin_.clear();
    const int positions = floats({0, 0, 0, 1, 0, 0, 0, 1, 0});
    level_["materials"] = materials;
    for (std::size_t m = 0; m < materials.size(); ++m) {
      const int shape = mesh({{"attributes", {{"POSITION", positions}}}, {"material", m}});
      json placed = {{"mesh", shape}};
      if (node_name != nullptr) placed["name"] = node_name;
      node(placed);
    }
    const auto imported = import();
    EXPECT_TRUE(imported.ok()) << (imported.ok() ? "" : imported.error().message);
    return imported.ok() ? imported->report.warnings : std::vector<std::string>();
  }
};

const json kBrick = {{"name", "wall_brick"}}, kCarpet = {{"name", "floor_carpet"}};
const json kOwn = {{"name", "m"}, {"extras", {{"acoustic", {{"preset", "carpet"}}}}}};

TEST_F(ToolLosses, OfThePaletteOfGltfTransformNameTheOptionsThatAvoidThem) {
  json palette = kOwn;
  palette["name"] = "PaletteMaterial001";
  for (const char* generator : {"glTF-Transform v4.5.1", "another tool later"})
    EXPECT_THAT(warnings(generator, json::array({palette, kBrick})),
                Contains(AllOf(HasSubstr("'PaletteMaterial001' covers 50 %"),
                               HasSubstr("--palette false --join false --flatten false --prune "
                                         "false --instance false"),
                               HasSubstr("--materials false"))));
  write("level.acoustics.json", R"({"materials": {"Palette*": "brick"}})");
  EXPECT_THAT(warnings("glTF-Transform v4.5.1", json::array({palette})),
              Not(Contains(HasSubstr("palette"))))
      << "the sidecar means it";
}

TEST_F(ToolLosses, OfOneMaterialForManyAreNamedAfterTheToolThatMadeIt) {
  EXPECT_THAT(
      warnings("glTF-Transform v4.5.1", json::array({kBrick})),
      Contains(AllOf(HasSubstr("'wall_brick' covers all"), HasSubstr("--materials false"))));
  EXPECT_THAT(
      warnings("gltfpack 1.3", json::array({kBrick})),
      Contains(AllOf(HasSubstr("'wall_brick' covers all"), HasSubstr("gltfpack -km -ke -kn"))));
  // Without -kn, and so probably without -km.
  EXPECT_THAT(warnings("gltfpack 1.3", json::array({kBrick, kCarpet}), nullptr),
              Contains(AllOf(HasSubstr("2 materials are left"), HasSubstr("emitters"))));
}

TEST_F(ToolLosses, AreNotSuspectedWhereMaterialsWereKept) {
  const auto none = Not(Contains(HasSubstr("wrote this level")));
  EXPECT_THAT(warnings("gltfpack 1.3", json::array({kBrick, kCarpet})), none);
  EXPECT_THAT(warnings("gltfpack 1.3", json::array({kOwn}), nullptr), none) << "-ke keeps extras";
  EXPECT_THAT(warnings("glTF-Transform v4.5.1", json::array({kBrick, kCarpet})), none);
  EXPECT_THAT(warnings("glTF-Transform v4.5.1", json::array({kOwn})), none);
  EXPECT_THAT(warnings("an exporter", json::array({kBrick})), none);
}

TEST_F(ToolLosses, OfAllEmittersAreNamedAfterTheTool) {
  EXPECT_THAT(warnings("glTF-Transform v4.5.1", json::array({kBrick, kCarpet})),
              Contains(AllOf(HasSubstr("nothing in the level makes a sound"),
                             HasSubstr("glTF-Transform v4.5.1 has dropped them"))));
  EXPECT_THAT(warnings("an exporter", json::array({kBrick})), Not(Contains(HasSubstr("dropped"))));
}

TEST_F(ToolLosses, DoNotConcernExtensionsThatThreeJsKeepsInExtras) {
  const auto kept = [](const json& extensions) { return json{{"gltfExtensions", extensions}}; };
  const json acoustic = {{"CLAMOR_materials_acoustic", {{"preset", "curtain"}}}};
  triangle();
  level_["materials"] =
      json::array({{{"name", "Brick"}, {"extras", kept(acoustic)}},
                   {{"name", "Brick 2"},
                    {"extras", kept(acoustic)},
                    {"extensions", {{"CLAMOR_materials_acoustic", {{"preset", "glass"}}}}}}});
  level_["meshes"][0]["primitives"][0]["material"] = 0;
  auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  EXPECT_EQ(imported->report.materials.at(0).preset, "curtain");
  EXPECT_EQ(imported->report.materials.at(0).how, "CLAMOR_materials_acoustic");
  level_["meshes"][0]["primitives"][0]["material"] = 1;
  imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  EXPECT_EQ(imported->report.materials.at(0).preset, "glass") << "what is in its place is newer";

  // An emitter of a node, where the list of emitters was dropped, and where it was kept.
  node({{"name", "Radio"}, {"extras", kept({{"KHR_audio_emitter", {{"emitter", 0}}}})}});
  imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  EXPECT_TRUE(imported->level.emitters.empty());
  EXPECT_THAT(imported->report.warnings,
              Contains(AllOf(HasSubstr("'Radio' has an emitter"), HasSubstr("in the sidecar"))));
  write("tone.wav", wav());
  level_["extensions"]["KHR_audio_emitter"] = {
      {"audio", {{{"uri", "tone.wav"}}}},
      {"sources", {{{"audio", 0}}}},
      {"emitters", {{{"type", "positional"}, {"sources", {0}}}}}};
  imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  ASSERT_EQ(imported->level.emitters.size(), 1u);
  EXPECT_EQ(imported->level.emitters[0].name, "Radio");
}

}  // namespace
}  // namespace clamor::testing
