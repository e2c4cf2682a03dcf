#include "bake/bake_plan.h"

#include <gtest/gtest.h>

#include "tests/rooms.h"

namespace clamor {
namespace {

using testing::shoebox;
using testing::uniform_material;

BakePlan plan(const Level& level, const BakeSettings& settings) {
  const Scene scene(level.mesh);
  return make_bake_plan(scene, level, settings, {});
}

Level room_with(std::size_t emitters) {
  Level level = shoebox({20, 10, 5}, uniform_material(0.2f), {1, 1, 1});
  level.emitters.resize(emitters, level.emitters[0]);
  for (std::size_t i = 0; i < emitters; ++i) {
    level.emitters[i].name = "emitter" + std::to_string(i);
    level.emitters[i].position_m = {
        1 + 18.0 * static_cast<double>(i) / static_cast<double>(emitters), 2, 2};
  }
  return level;
}

TEST(BakePlan, DistributesPhotonsByPowerWithAMinimumPerEmitter) {
  Level level = room_with(3);
  level.emitters[0].gain = 3;
  level.emitters[2].gain = 0.001;
  const BakePlan found = plan(level, {.photons = 10000});
  EXPECT_EQ(found.photons[0], 9000u);
  EXPECT_EQ(found.photons[1], 1000u);
  EXPECT_EQ(found.photons[2], kMinPhotons);
}

TEST(BakePlan, GivesSilentEmittersNoPhotons) {
  Level level = room_with(2);
  level.emitters[1].gain = 0;
  EXPECT_EQ(plan(level, {.photons = 10000}).photons[1], 0u);
}

TEST(BakePlan, ManyEmittersNeedNoMorePhotonsThanOne) {
  const std::uint64_t one = plan(room_with(1), {}).all_photons();
  const std::uint64_t many = plan(room_with(5000), {}).all_photons();
  EXPECT_LT(many, 2 * one);
}

TEST(BakePlan, CountsRoomsByVisibilityBetweenEmitters) {
  // Two separate boxes with a gap between them.
  Level level = room_with(2);
  Mesh other = testing::box({20, 10, 5});
  const auto first = static_cast<std::uint32_t>(level.mesh.vertices_m.size());
  for (Vec3f& vertex : other.vertices_m) level.mesh.vertices_m.push_back(vertex + Vec3f(21, 0, 0));
  for (auto triangle : other.triangles) {
    for (auto& corner : triangle) corner += first;
    level.mesh.triangles.push_back(triangle);
    level.mesh.materials.push_back(0);
  }
  EXPECT_EQ(plan(level, {}).rooms, 1u);
  EXPECT_EQ(plan(level, {}).sources, 200000u);
  level.emitters[1].position_m = {30, 5, 2};
  EXPECT_EQ(plan(level, {}).rooms, 2u);
  EXPECT_EQ(plan(level, {}).sources, 400000u);
}

TEST(BakePlan, ThinsWhileTracingOnlyIfDepositsFarExceedSources) {
  EXPECT_EQ(plan(room_with(1), {.photons = 100, .sources = 100000}).deposit_threshold, 0);
  const double some = plan(room_with(1), {.photons = 100000, .sources = 10000}).deposit_threshold;
  const double more = plan(room_with(1), {.photons = 1000000, .sources = 10000}).deposit_threshold;
  EXPECT_GT(some, 0);
  EXPECT_GT(more, 5 * some);
}

TEST(BakePlan, MovingOneOfFiftyEmittersLeavesTheOthersPhotonsUnchanged) {
  Level level = room_with(50);
  const BakePlan before = plan(level, {});
  level.emitters[17].position_m = {15, 8, 4};
  const BakePlan after = plan(level, {});
  EXPECT_EQ(before.photons, after.photons);
  EXPECT_EQ(before.deposit_threshold, after.deposit_threshold);
}

TEST(BakePlan, BatchesContainEveryPhotonOnceWithinTheirLimit) {
  BakePlan some;
  some.photons = {5, 0, 2000, 1024, 300, 4, 4, 4000};
  std::vector<std::uint64_t> next(some.photons.size(), 0);
  for (const auto& batch : some.batches()) {
    std::uint64_t photons = 0;
    for (const PhotonRun& run : batch) {
      EXPECT_EQ(run.first, next[run.emitter]);
      next[run.emitter] += run.count;
      photons += run.count;
    }
    EXPECT_LE(photons, kRunPhotons);
  }
  EXPECT_EQ(next, some.photons);
}

}  // namespace
}  // namespace clamor
