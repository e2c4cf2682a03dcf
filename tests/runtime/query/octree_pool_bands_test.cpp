// octree_pool_bands_test.cpp: the pool's use of band-wise levels.
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/query/octree_pool.h"
#include "tests/runtime/syllables.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

// The bands of these sounds vary independently, so most sources that pass by the loudest band are
// too quiet. A pool that used only that would find half as many again.
TEST(OctreePool, FindsFewSourcesBelowTheCurrentThreshold) {
  const std::vector<Emitter> emitters(1);
  const std::vector<Material> materials(1);
  const RadiationModel radiation(emitters, materials, Air{});
  const std::vector<TimedEnvelope> sounds = {testing::syllables(3)};
  const SignalWeights weights = make_signal_weights(sounds);
  std::vector<Source> sources(30'000);
  for (std::uint32_t i = 0; i < sources.size(); ++i) {
    const RandomBits a = philox(8, {i, 0, 0, 0}), b = philox(8, {i, 1, 0, 0});
    sources[i].position_m =
        Vec3f(static_cast<float>(20 * unit(a[0])), 0, static_cast<float>(20 * unit(a[1])));
    sources[i].normal = sources[i].mirror = Vec3f(0, 1, 0);
    sources[i].delay_s = static_cast<float>(0.05 + unit(a[2]));
    sources[i].u = static_cast<float>(unit_above_zero(a[3]));
    sources[i].power[b[0] % 2 == 0 ? 1 : 6] = static_cast<float>(std::pow(10, -3 * unit(b[1])));
  }
  testing::StoredTrees trees;
  trees.add(build_octree(std::move(sources)));
  PageLoader loader(trees.fetch(radiation, weights), PageBudget{1'000'000'000});
  OctreePool pool(radiation, weights, trees.tops(), {}, loader);
  constexpr double kThreshold = 0.1;
  std::size_t found_in_all = 0, reach = 0;
  for (int i = 0; i < 50; ++i) {
    const Vec3 place(6 + 0.03 * i, 1.7, 9);
    const double time_s = 4 + 0.02 * i;
    std::vector<FoundSource> found;
    do {
      found.clear();
      pool.refresh();
      pool.begin({place, time_s});
      ASSERT_TRUE(pool.find_above(kThreshold, std::numeric_limits<std::size_t>::max(), found));
      pool.request_pages(kThreshold);
    } while (!pool.complete());
    if (i < 10) continue;  // shortlists are made first
    found_in_all += found.size();
    for (const FoundSource& one : found) {
      const auto now = weights_at_place(radiation, weights, one.signal, *one.source, place, time_s);
      const double priority = weight(radiation, now.weights, *one.source, place) * one.boost /
                              static_cast<double>(one.source->u);
      reach += priority >= kThreshold;
    }
  }
  EXPECT_GT(reach, 10'000u);
  EXPECT_LT(static_cast<double>(found_in_all), 1.15 * static_cast<double>(reach));
}

}  // namespace
}  // namespace clamor
