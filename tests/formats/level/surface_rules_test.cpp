#include "formats/level/surface_rules.h"

#include <gtest/gtest.h>

namespace clamor::testing {
namespace {

using enum NoSurface;

TEST(SurfaceRules, KnowTheConventionsOfExporters) {
  MeshNames names;
  for (const char* visible : {"Walls", "Tree", "Rock_LOD0"}) names.add(visible, true);
  const struct {
    const char* name;
    NoSurface reason;
  } expected[] = {{"UCX_Walls", kCollisionHull},
                  {"UBX_Walls_01", kCollisionHull},
                  {"usp_walls", kCollisionHull},
                  {"UCP_Walls.001", kCollisionHull},
                  {"Walls-col", kCollisionHull},
                  {"Walls-col.003", kCollisionHull},
                  {"Walls-convcol", kCollisionHull},
                  {"Anything-colonly", kCollisionHull},
                  {"Anything-convcolonly2", kCollisionHull},
                  {"Anything$colonly", kCollisionHull},
                  {"Floor-navmesh", kNavigationMesh},
                  {"Walls-occ", kOccluder},
                  {"Walls-occonly", kOccluder},
                  {"Tree_LOD1", kLevelOfDetail},
                  {"Rock_LOD2", kLevelOfDetail},
                  {"Rock_LOD0", kNothing},
                  {"Lone_LOD1", kNothing},
                  {"Walls", kNothing},
                  {"Color", kNothing},
                  {"Melody", kNothing},
                  {"Truck", kNothing}};
  for (const auto& [name, reason] : expected) names.add(name, true);
  for (const auto& [name, reason] : expected) EXPECT_EQ(names.reason_for(name), reason) << name;
}

// Godot shows a mesh 'Room-col' and makes its collider of it; only beside 'Room' is it a copy.
TEST(SurfaceRules, KeepALoneMeshThatGodotShows) {
  MeshNames names;
  names.add("Room-col", true);
  names.add("Hall", false);
  names.add("Hall-col", true);
  EXPECT_EQ(names.reason_for("Room-col"), kNothing);
  EXPECT_TRUE(names.is_lone("Room-col"));
  EXPECT_EQ(names.reason_for("Hall-col"), kNothing) << "a group is no mesh";
  EXPECT_FALSE(names.is_lone("Hall"));
}

TEST(SurfaceRules, TellSkiesFromWhatOnlySoundsLikeThem) {
  for (const char* sky : {"Sky", "sky.001", "SkyBox", "Skydome_02", "M_Skybox", "sky_sphere",
                          "Sky Material", "SM_SkySphere", "Night_Sky"})
    EXPECT_TRUE(is_sky(sky)) << sky;
  for (const char* other :
       {"Skylight", "SkyLight", "Skyscraper", "Sky_Lobby", "Dome", "Whisky", "Skywalk", "", "Box"})
    EXPECT_FALSE(is_sky(other)) << other;
}

TEST(SurfaceRules, GiveWayToPatternsTheLastOriginFirst) {
  SurfaceChoice choice({{{"Tree*", "Hut"}, {"UCX_*"}}, {{"UCX_Old"}, {"Tree_1"}}});
  EXPECT_EQ(choice.keeps("Tree_1"), true) << "the command line keeps what the sidecar ignores";
  EXPECT_EQ(choice.keeps("Tree_2"), false);
  EXPECT_EQ(choice.keeps("UCX_New"), true);
  EXPECT_EQ(choice.keeps("UCX_Old"), false);
  EXPECT_EQ(choice.keeps("Wall"), std::nullopt);
  EXPECT_EQ(choice.unused(), std::vector<std::string>{"Hut"});
}

}  // namespace
}  // namespace clamor::testing
