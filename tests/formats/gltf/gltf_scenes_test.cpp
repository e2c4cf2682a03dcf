#include <gmock/gmock.h>

#include "tests/formats/box_level.h"

namespace clamor::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Scenes : public BoxLevelTest {
 protected:
  void SetUp() override {
    BoxLevelTest::SetUp();
    box("Lobby");
    box("Hall_A");
    box("Hall_B");
    level_["scenes"] = {{{"name", "lobby"}, {"nodes", {0}}}, {{"name", "hall"}, {"nodes", {1, 2}}}};
  }
};

TEST_F(Scenes, OtherThanTheBakedOneAreNamed) {
  EXPECT_EQ(boxes(), 1u);
  EXPECT_THAT(import()->report.ignored,
              Contains("scene 1 'hall' with 24 triangles in 2 meshes (--scene 'hall' bakes it)"));
  EXPECT_EQ(boxes({.scene = "hall"}), 2u);
  EXPECT_EQ(boxes({.scene = "1"}), 2u);
  level_["scene"] = 1;
  EXPECT_EQ(boxes(), 2u);
  EXPECT_EQ(boxes({.scene = "lobby"}), 1u);
}

TEST_F(Scenes, ThatDoNotExistAreAnErrorWithAList) {
  EXPECT_THAT(refusal({.scene = "cellar"}),
              HasSubstr("has no scene 'cellar'; it has 0 'lobby', 1 'hall'."));
  EXPECT_THAT(refusal({.scene = "2"}), HasSubstr("has no scene '2'"));
}

TEST_F(Scenes, WithMeshesAreNamedBesideAnEmptyDefault) {
  level_["scenes"].push_back({{"name", "empty"}});
  level_["scene"] = 2;
  EXPECT_THAT(import()->report.warnings,
              Contains(AllOf(HasSubstr("scene 2 'empty' is baked, which has no meshes"),
                             HasSubstr("--scene 'lobby'"), HasSubstr("--scene 'hall'"))));
}

TEST_F(Scenes, MayLackMeshesThatTheFileHas) {
  level_["scenes"].erase(1);
  EXPECT_THAT(import()->report.ignored,
              Contains("24 triangles in 2 meshes on nodes that belong to no scene"));
  level_.erase("scenes");
  EXPECT_EQ(boxes(), 3u);
  EXPECT_THAT(import()->report.ignored, IsEmpty());
}

class RequiredExtensions : public BoxLevelTest {
 protected:
  void SetUp() override {
    BoxLevelTest::SetUp();
    box("Walls", {0, 0, 0}, {4, 3, 5}, material({{"name", "brick"}}));
  }
};

TEST_F(RequiredExtensions, ThatTouchNeitherGeometryNorSoundAreFine) {
  for (const char* name :
       {"KHR_physics_rigid_bodies", "KHR_implicit_shapes", "OMI_physics_body",
        "MSFT_collision_primitives", "KHR_interactivity", "KHR_node_selectability",
        "EXT_structural_metadata", "KHR_xmp_json_ld", "VRM", "VRMC_vrm", "VRMC_springBone",
        "EXT_instance_features", "MOZ_hubs_components", "KHR_texture_basisu",
        "EXT_lights_image_based", "KHR_materials_variants"}) {
    level_["extensionsRequired"] = {name};
    EXPECT_TRUE(import().ok()) << name;
  }
}

TEST_F(RequiredExtensions, ThatOnlyLooksUseAreFine) {
  level_["extensionsRequired"] = {"ACME_glow"};
  EXPECT_THAT(refusal(), HasSubstr("may change its geometry"));
  level_["materials"][0]["extensions"] = {{"ACME_glow", json::object()}};
  EXPECT_TRUE(import().ok());
}

TEST_F(RequiredExtensions, ThatMayChangeTheSoundSayWhatAndHowToGoOn) {
  level_["extensionsRequired"] = {"ACME_terrain"};
  level_["nodes"][0]["extensions"] = {{"ACME_terrain", json::object()}};
  EXPECT_THAT(refusal(),
              AllOf(HasSubstr("'ACME_terrain'"),
                    HasSubstr("which meshes there are, and where (1 of its nodes has it)"),
                    HasSubstr("--ignore-required ACME_terrain")));
  EXPECT_TRUE(import({.ignored_extensions = {"ACME_terrain"}}).ok());
  level_["nodes"][0].erase("extensions");
  level_["meshes"][0]["primitives"][0]["extensions"] = {{"ACME_terrain", json::object()}};
  EXPECT_THAT(refusal(), HasSubstr("the triangles of meshes"));
  level_["extensionsRequired"] = {"CESIUM_RTC"};
  EXPECT_THAT(refusal(), HasSubstr("where the whole level lies"));
}

}  // namespace
}  // namespace clamor::testing
