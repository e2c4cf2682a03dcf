// occlusion_batch_test.cpp: batches of visibility tests against single ones.
#include "runtime/occlusion/occlusion_batch.h"

#include <array>

#include <gtest/gtest.h>

#include "runtime/occlusion/visibility_cache.h"
#include "tests/runtime/two_rooms.h"

namespace clamor {
namespace {

using namespace testing;

std::vector<const Source*> pointers(const World& world) {
  std::vector<const Source*> pointers;
  for (const Source& source : world.sources) pointers.push_back(&source);
  return pointers;
}

TEST(OcclusionBatch, EqualSingleTestsWithAsManyRays) {
  const World world(two_rooms(true), 60);
  for (const Vec3& place : {Vec3(2, 2, 1.6), Vec3(6.2, 2.4, 1.6), Vec3(9, 0.3, 2.5)}) {
    std::vector<LineOfSight> lines;
    for (const Source& source : world.sources)
      if (const auto start_m = world.surfaces.ray_origin(source))
        lines.push_back({*start_m, Vec3f(place), kSpeed_mps});
    ASSERT_GT(lines.size(), 500u);
    const auto looks = estimate_visibilities(world.surfaces, lines, kMediumPaths);
    int partial = 0;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      VisibilityEstimate one;
      one.diffracted =
          fresnel_visibility(world.surfaces, lines[i], kMediumPaths, one.rays, &one.line_is_free);
      ASSERT_EQ(looks[i].diffracted, one.diffracted) << "line " << i;
      ASSERT_EQ(looks[i].line_is_free, one.line_is_free);
      ASSERT_EQ(looks[i].rays, one.rays);
      partial += is_partial(one.diffracted);
    }
    EXPECT_GE(partial, place.x > 5 ? 20 : 0);
  }
}

TEST(OcclusionBatch, RefineOnlyPartialVisibilityAndAreTheSameOnAnyNumberOfThreads) {
  const World world(two_rooms(true), 60);
  const Vec3 place(6.2, 2.4, 1.6);
  const auto sources = pointers(world);
  const auto once = fine_visibility(world.surfaces, kSpeed_mps, sources, place, 1);
  ASSERT_EQ(once.size(), sources.size());
  int partial = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    ASSERT_EQ(once[i], fine_visibility(world.surfaces, kSpeed_mps, *sources[i], place));
    partial += is_partial(once[i]);
  }
  EXPECT_GT(partial, 20);
  for (const unsigned threads : {0u, 2u, 7u})
    EXPECT_EQ(fine_visibility(world.surfaces, kSpeed_mps, sources, place, threads), once);
}

TEST(OcclusionBatch, OfAllSourcesEqualTheCachesSingleTestsOnAWalk) {
  const World world(two_rooms(true), 20);
  VisibilityCache one_by_one(world.surfaces, kSpeed_mps, {}),
      at_once(world.surfaces, kSpeed_mps, {});
  std::vector<VisibilityCache::Wanted> wanted;
  for (std::size_t i = 0; i < world.sources.size(); ++i)
    wanted.push_back({.number = i, .source = &world.sources[i]});
  for (int keyframe = 0; keyframe < 12; ++keyframe) {
    const Vec3 place(5.5 + 0.05 * keyframe, 2.4, 1.6);
    one_by_one.begin_keyframe(place);
    at_once.begin_keyframe(place);
    const auto visible = at_once.estimate_now(wanted);
    for (std::size_t i = 0; i < wanted.size(); ++i)
      ASSERT_EQ(visible[i], one_by_one.estimate_now(i, world.sources[i]));
    ASSERT_EQ(at_once.statistics().estimates, one_by_one.statistics().estimates);
    ASSERT_EQ(at_once.statistics().rays, one_by_one.statistics().rays);
  }
  // Cached visibilities that are still valid are not tested again.
  EXPECT_LT(at_once.statistics().estimates, 11 * wanted.size());
}

TEST(OcclusionBatch, WithoutSurfacesAreFreeAndCastNoRays) {
  const OcclusionGeometry free_field(Mesh{}, {});
  const std::array<LineOfSight, 2> lines = {{{{0, 0, 0}, {1, 0, 0}}, {{0, 0, 2}, {1, 0, 0}}}};
  for (const VisibilityEstimate& look : estimate_visibilities(free_field, lines, kMediumPaths)) {
    EXPECT_EQ(look.diffracted, same_in_all_bands(1));
    EXPECT_TRUE(look.line_is_free);
    EXPECT_EQ(look.rays, 0u);
  }
  EXPECT_TRUE(estimate_visibilities(free_field, {}, kMediumPaths).empty());
}

}  // namespace
}  // namespace clamor
