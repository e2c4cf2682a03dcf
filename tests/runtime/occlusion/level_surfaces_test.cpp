// level_surfaces_test.cpp: what listeners in a level share, and what each has for itself.
#include "runtime/occlusion/level_surfaces.h"

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "tests/box_mesh.h"
#include "tests/runtime/door_leaf.h"

namespace clamor {
namespace {

TEST(LevelSurfaces, BuildEachBvhOnceAndNoFastOneOnceThereIsABetterOne) {
  const auto level = std::make_shared<LevelSurfaces>(testing::box({4, 4, 3}));
  const auto fast = level->bvh(BvhQuality::kFast);
  EXPECT_EQ(level->bvh(BvhQuality::kFast), fast);
  EXPECT_NE(level->bvh(BvhQuality::kPortable), fast);
  while (!level->better_bvh()) std::this_thread::yield();
  EXPECT_NE(*level->better_bvh(), fast);
  EXPECT_EQ(level->bvh(BvhQuality::kFast), *level->better_bvh());
}

TEST(LevelSurfaces, AnswerListenersThatComeAtTheSameTime) {
  const auto level = std::make_shared<LevelSurfaces>(testing::box({4, 4, 3}));
  std::atomic<int> right = 0;
  std::vector<std::jthread> listeners;
  for (int i = 0; i < 4; ++i)
    listeners.emplace_back([&] {
      OcclusionGeometry of_one(level, std::vector<Material>(1), BvhQuality::kFast);
      const auto answers_right = [&] {
        return of_one.is_free({1, 1, 1}, {3, 3, 2}) && !of_one.is_free({1, 1, 1}, {1, 1, 4});
      };
      right += answers_right();
      while (!of_one.improve()) std::this_thread::yield();
      right += answers_right();
    });
  listeners.clear();
  EXPECT_EQ(right, 8);
}

// Portals and doors belong to a listener's own scene of parts.
TEST(LevelSurfaces, LeaveEachListenerItsOwnDoors) {
  const std::vector<Material> materials(1);
  const auto level = std::make_shared<LevelSurfaces>(testing::box({10, 4, 3}));
  OcclusionGeometry with_door(level, materials);
  const OcclusionGeometry without(level, materials);
  MovingParts parts;
  PartScene scene;
  const auto leaf = PartShape::make(testing::door_leaf(), materials);
  ASSERT_TRUE(leaf.ok() && parts.add(*leaf, testing::door_pose(0)).ok());
  with_door.set_parts(&scene);
  scene.update(parts);
  const Vec3f from_m(4, 2, 1), to_m(6, 2, 1);
  EXPECT_TRUE(without.is_free(from_m, to_m));
  EXPECT_FALSE(with_door.is_free(from_m, to_m));
}

}  // namespace
}  // namespace clamor
