#include <gmock/gmock.h>

#include "common/sample_rate.h"
#include "tests/build_paths.h"
#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

#define SKIP_WITHOUT(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not here"

// Triangles as the files' own index counts give them, less those without area.
TEST(RealLevel, HasAllItsTriangles) {
  const struct {
    const char* name;
    std::size_t triangles, without_area;
  } levels[] = {{"bathroom.glb", 14358, 2},   {"sampleroom.gltf", 2180, 0},
                {"shoebox_5x4x3.glb", 12, 0}, {"sibenik.glb", 75284, 9},
                {"sponza.glb", 66454, 1},     {"stadium.glb", 3900, 260}};
  SKIP_WITHOUT(shared_level("sponza.glb"));
  for (const auto& [name, triangles, without_area] : levels) {
    const auto imported = import_level(shared_level(name), {});
    ASSERT_TRUE(imported.ok()) << imported.error().message;
    EXPECT_EQ(imported->level.mesh.triangles.size(), triangles - without_area) << name;
    std::size_t reported = 0;
    for (const auto& material : imported->report.materials) reported += material.triangles;
    EXPECT_EQ(reported, triangles - without_area) << name;
  }
}

TEST(RealLevel, ShoeboxHasTheAreaOfItsWalls) {
  SKIP_WITHOUT(shared_level("shoebox_5x4x3.glb"));
  const auto imported = import_level(shared_level("shoebox_5x4x3.glb"), {});
  ASSERT_TRUE(imported.ok());
  EXPECT_NEAR(imported->report.materials.at(0).area_m2, 2 * (5 * 4 + 5 * 3 + 4 * 3), 1e-5);
}

TEST(RealLevel, BoomBoxPlaysItsMusic) {
  SKIP_WITHOUT(shared_level("boom_box/boom_box.gltf"));
  const auto imported = import_level(shared_level("boom_box/boom_box.gltf"), {});
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  ASSERT_EQ(imported->level.emitters.size(), 1u);
  EXPECT_NEAR(imported->level.emitters[0].gain, 0.3, 1e-12);
  EXPECT_GT(imported->level.signals.at(0).samples.size(), 20u * kSampleRate_hz);
}

TEST(RealLevel, TeapotsStandAtEveryInstance) {
  SKIP_WITHOUT(shared_level("teapots/teapots_galore.gltf"));
  const auto imported = import_level(shared_level("teapots/teapots_galore.gltf"), {});
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  // 958 + 941 pots of 4032 triangles on two of ground; what has no area is left out.
  EXPECT_LE(imported->level.mesh.triangles.size(), 1899u * 4032 + 2);
  EXPECT_GE(imported->level.mesh.triangles.size(), 1899u * 4032 * 99 / 100);
}

// Triangles as the accessors of the files count them.
TEST(RealLevel, ThatIsCompressedHasAllItsTriangles) {
  SKIP_WITHOUT(shared_level("meshopt_compressed.glb"));
  for (const auto& [name, triangles] : {std::pair("meshopt_compressed.glb", std::size_t{177934}),
                                        std::pair("draco_compressed.glb", std::size_t{32877})}) {
    const auto imported = import_level(shared_level(name), {});
    ASSERT_TRUE(imported.ok()) << imported.error().message;
    const std::size_t found = imported->level.mesh.triangles.size();
    EXPECT_LE(found, triangles) << name;
    EXPECT_GE(found, triangles * 95 / 100) << name;  // quantisation leaves some without area
  }
}

}  // namespace
}  // namespace clamor::testing
