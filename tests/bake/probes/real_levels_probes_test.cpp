// real_levels_probes_test.cpp: places probes in levels from other sources.
#include <filesystem>

#include <gtest/gtest.h>

#include "bake/probes/floor_spots.h"
#include "bake/probes/reachable_air.h"
#include "formats/gltf/level_import.h"
#include "tests/bake/probes/probe_levels.h"
#include "tests/build_paths.h"

namespace clamor {
namespace {

struct RealLevel {
  const char* file;
  Vec3 emitter_m;
  double near_m;  // the middle of the floor
};

void PrintTo(const RealLevel& level, std::ostream* out) { *out << level.file; }

class ProbesInRealLevels : public ::testing::TestWithParam<RealLevel> {};

TEST_P(ProbesInRealLevels, AreSeenFromTheFloorNearTheMiddle) {
  const std::string path = testing::shared_level(GetParam().file);
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "not on this machine: " << path;
  auto imported = import_level(path, {});
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  Level& level = imported->level;
  level.emitters = {testing::named_emitter("source", GetParam().emitter_m)};
  const Scene scene(level.mesh);
  const ProbePlacement placement = testing::placed(level);

  EXPECT_GE(placement.positions_m.size(), 60u);
  EXPECT_LE(placement.positions_m.size(), 450u);
  const ReachableAir air(scene, level, 10);
  std::size_t looked = 0;
  for (const FloorSpot& spot : find_floor(scene, air.lattice())) {
    if (std::abs(spot.ear_m.x) > GetParam().near_m || std::abs(spot.ear_m.z) > GetParam().near_m)
      continue;
    ++looked;
    EXPECT_TRUE(
        testing::sees_a_probe(scene, spot.ear_m, placement.positions_m, 2 * placement.spacing_m))
        << spot.ear_m.x << " " << spot.ear_m.y << " " << spot.ear_m.z;
  }
  EXPECT_GT(looked, 100u);
}

INSTANTIATE_TEST_SUITE_P(All, ProbesInRealLevels,
                         ::testing::Values(RealLevel{"sponza.glb", {0, 2, 0}, 5},
                                           RealLevel{"stadium.glb", {0, 2, 0}, 18}),
                         [](const auto& level) {
                           const std::string file = level.param.file;
                           return file.substr(0, file.find('.'));
                         });

}  // namespace
}  // namespace clamor
