// level_extent_test.cpp: which places are outside of a level.
#include "formats/bake_file/level_extent.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/formats/bake_examples.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using ::testing::HasSubstr;

// The surfaces of testing::contents() lie between 0,0,0 and 1.0005,2,3, and its emitter at
// 1.23,2,3.
LevelExtent extent(const std::string& closedness, double escaped_share,
                   const Vec3& origin_m = Vec3(0), bool has_surfaces = true) {
  BakeContents contents = testing::contents();
  contents.statistics.findings = {closedness, escaped_share, 0, {}};
  contents.origin_m = origin_m;
  if (!has_surfaces) contents.mesh = {};
  const testing::TemporaryFile file(".clamor");
  EXPECT_TRUE(write_bake(file.path(), contents, 1).ok());
  const auto opened = BakeFile::open(file.path());
  EXPECT_TRUE(opened.ok());
  return LevelExtent(*opened, *opened->read_mesh());
}

bool is_outside(const LevelExtent& level, const Vec3& place_m) {
  return level.complaint("the listener", place_m).has_value();
}

TEST(LevelExtent, EndsAtTheSurfacesAndEmittersOfAClosedLevel) {
  const LevelExtent level = extent("closed", 0);
  for (const Vec3& inside_m : {Vec3(0.5, 1, 1), Vec3(0, 0, 0), Vec3(1.2, 2, 3)})
    EXPECT_FALSE(is_outside(level, inside_m)) << inside_m.x;
  for (const Vec3& outside_m : {Vec3(0.5, 2.1, 1), Vec3(-0.1, 1, 1), Vec3(0.5, 1, 3.1)})
    EXPECT_TRUE(is_outside(level, outside_m)) << outside_m.x;
}

TEST(LevelExtent, ReachesItsDiagonalFurtherWhereSoundLeavesOrMay) {
  for (const LevelExtent& level : {extent("open", 0.3), extent("", 0)}) {
    // The diagonal is 3.81 m.
    EXPECT_FALSE(is_outside(level, {0.5, 5.7, 1}));
    EXPECT_TRUE(is_outside(level, {0.5, 5.9, 1}));
  }
}

TEST(LevelExtent, IsToldInTheWorldWithTheThing) {
  const auto complaint =
      extent("closed", 0, {5000, 0, -700}).complaint("the listener", {100, 1.7, 3});
  ASSERT_TRUE(complaint.has_value());
  EXPECT_THAT(*complaint, HasSubstr("the listener at 100,1.7,3 is outside the level"));
  EXPECT_THAT(*complaint, HasSubstr("between 5000.00,0,-700 and 5001.23,2,-697;"));
}

TEST(LevelExtent, OfNoSurfacesIsEverywhere) {
  EXPECT_FALSE(is_outside(extent("closed", 0, Vec3(0), false), {1e6, 0, 0}));
  EXPECT_FALSE(is_outside(LevelExtent(), {1e6, 0, 0}));
}

}  // namespace
}  // namespace clamor
