#include "runtime/query/octree_pool.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "formats/bake_file/page.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/sampling/sampler.h"
#include "tests/runtime/complete_sample.h"
#include "tests/sanitized.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

// Sources on the walls of a hall, with materials from Lambertian to mirror-like, and emitters that
// play signals of different spectra.
struct Hall {
  explicit Hall(std::uint64_t seed, std::uint32_t count) {
    for (const float exponent : {0.0f, 4.0f, 100.0f}) {
      Material& material = materials.emplace_back();
      material.scattering = same_in_all_bands(exponent > 0 ? 0.2f : 1.0f);
      material.phong = same_in_all_bands(exponent);
    }
    weights.by_signal = {{1, 2, 3, 4, 5, 4, 3, 2}, {0.1f, 0, 0, 0, 0, 0, 0.5f, 2}};
    for (std::uint32_t e = 0; e < 4; ++e) {
      Emitter& emitter = emitters.emplace_back();
      const RandomBits bits = philox(seed, {e, 7, 0, 0});
      emitter.position_m = {20 * unit(bits[0]), 8 * unit(bits[1]), 15 * unit(bits[2])};
      emitter.signal = e % 2;
      emitter.directivity = same_in_all_bands(static_cast<float>(e));
    }
    std::vector<Source> sources;
    for (std::uint32_t i = 0; i < count; ++i) {
      const RandomBits a = philox(seed, {i, 0, 0, 0}), b = philox(seed, {i, 1, 0, 0}),
                       c = philox(seed, {i, 2, 0, 0});
      const std::uint32_t face = a[3] % 6;
      const int axis = static_cast<int>(face / 2);
      Vec3 place(unit(a[0]), unit(a[1]), unit(a[2])), normal(0);
      place[axis] = face % 2;
      normal[axis] = face % 2 == 0 ? 1 : -1;
      const double cos_i = std::sqrt(unit_above_zero(b[0])), sin_i = std::sqrt(1 - cos_i * cos_i);
      const double turn = 2 * std::numbers::pi * unit(b[1]);
      Vec3 mirror = normal * cos_i;
      mirror[(axis + 1) % 3] = sin_i * std::cos(turn);
      mirror[(axis + 2) % 3] = sin_i * std::sin(turn);
      Source& source = sources.emplace_back();
      source.position_m = Vec3f(place * Vec3(20, 8, 15));
      source.normal = Vec3f(normal);
      source.mirror = Vec3f(mirror);
      source.delay_s = static_cast<float>(unit(b[2]));
      for (std::size_t band = 0; band < kBandCount; ++band)
        source.power[band] = static_cast<float>(std::pow(10, -5 * unit(b[3]) - 0.1 * band));
      source.patch_radius_m = static_cast<float>(0.5 * unit(c[0]));
      source.u = static_cast<float>(unit_above_zero(c[1]));
      source.emitter = c[2] % 4;
      source.material = static_cast<std::uint16_t>(c[3] % 3);
    }
    for (std::uint32_t e = 0; e < 4; ++e) {
      Source& source = sources.emplace_back();
      source.emitter = e;
      set_from_emitter(source, emitters[e]);
      source.u = 0.5f;
    }
    trees.add(build_octree(std::move(sources)));
    all = trees.all_sources();
  }

  RadiationModel radiation(const LateBoost& late_boost = {}) const {
    return {emitters, materials, Air{}, late_boost};
  }

  double total_power_at(const RadiationModel& radiation, const Vec3& place) const {
    double sum = 0;
    for (const Source& source : all)
      sum += weight(radiation, weights.by_signal[radiation.signal(source)], source, place);
    return sum;
  }

  double priority_of_rank(std::ptrdiff_t rank, const RadiationModel& radiation,
                          const Vec3& place) const {
    std::vector<double> priorities;
    for (const Source& source : all)
      priorities.push_back(
          weight(radiation, weights.by_signal[radiation.signal(source)], source, place) /
          std::max<double>(source.u, kMinU));
    const auto ranked = priorities.begin() + rank;
    std::nth_element(priorities.begin(), ranked, priorities.end(), std::greater<>());
    return *ranked;
  }

  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  SignalWeights weights;
  testing::StoredTrees trees;
  std::vector<Source> all;
};

Vec3 random_place(std::uint64_t seed, std::uint32_t i) {
  const RandomBits bits = philox(seed, {i, 8, 0, 0});
  // In the hall and around it.
  return {30 * unit(bits[0]) - 5, 12 * unit(bits[1]) - 2, 25 * unit(bits[2]) - 5};
}

TEST(OctreePool, GivesTheSampleOfAScanOfAllSources_NoAsan) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const Hall hall(seed, seed % 2 == 0 ? 3000 : 20'000);
    // Two of three seeds boost late sources.
    const RadiationModel radiation = hall.radiation(LateBoost(0.6 * static_cast<double>(seed % 3)));
    for (const std::size_t voices : {1u, 30u, 500u, 5000u}) {
      PageLoader loader(hall.trees.fetch(radiation, hall.weights), PageBudget{1'000'000'000});
      OctreePool pool(radiation, hall.weights, hall.trees.tops(), {}, loader);
      SourceList list(radiation, hall.weights, hall.all);
      const auto by_tree = make_priority_sampler(radiation, hall.weights, pool, voices);
      const auto by_scan = make_priority_sampler(radiation, hall.weights, list, voices);
      for (std::uint32_t i = 0; i < 20; ++i) {
        const Vec3 place = i < 10 ? Vec3(3 + 0.1 * i, 1.7, 4) : random_place(seed, i);
        const auto found = testing::complete_sample(*by_tree, place),
                   expected = by_scan->sample(place);
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t s = 0; s < found.size(); ++s) {
          ASSERT_EQ(found[s].number, expected[s].number) << seed << " " << voices << " " << i;
          ASSERT_EQ(found[s].power_scale, expected[s].power_scale);
        }
      }
    }
  }
}

TEST(OctreePool, VisitsFewNodes) {
  Hall hall(1, 200'000);
  for (Material& material : hall.materials) material.scattering = same_in_all_bands(1);
  const RadiationModel radiation = hall.radiation();
  PageLoader loader(hall.trees.fetch(radiation, hall.weights), PageBudget{1'000'000'000});
  OctreePool pool(radiation, hall.weights, hall.trees.tops(), {}, loader);
  const auto sampler = make_priority_sampler(radiation, hall.weights, pool, 200);
  testing::complete_sample(*sampler, {10, 1.7, 7});
  const std::uint64_t before = pool.nodes_visited();
  sampler->sample(Vec3(10.03, 1.7, 7));
  EXPECT_LT(pool.nodes_visited() - before, hall.trees.page_count() / 4);
}

// Shortlists of pages that have not mattered for long are dropped. If that ended the front, the
// next keyframes would traverse the tree, which takes several times as long.
TEST(OctreePool, KeepsItsFrontWhenUnusedShortlistsAreDropped) {
  const Hall hall(3, 100'000);
  const RadiationModel radiation = hall.radiation();
  PageLoader loader(hall.trees.fetch(radiation, hall.weights), PageBudget{1'000'000'000});
  OctreePool pool(radiation, hall.weights, hall.trees.tops(), {}, loader);
  double time_s = 0;
  const auto query = [&](const Vec3& place, double threshold) {
    do {
      std::vector<FoundSource> found;
      pool.refresh();
      pool.begin({Listener(place, {}, {0.2, 0, 0}), time_s += 0.02});
      pool.find_above(threshold, hall.all.size(), found);
      pool.request_pages(threshold);
    } while (!pool.complete());
  };
  query({10, 1.7, 7}, 0);  // loads all pages and makes a list for each
  const double threshold = hall.priority_of_rank(300, radiation, {10, 1.7, 7});
  const auto sway = [&](double x_m, int keyframes) {
    for (int k = 0; k < keyframes; ++k) query({x_m + 0.001 * (k % 2), 1.7, 7}, threshold);
  };
  sway(25, 100);  // the threshold of 0 is forgotten
  sway(10, 100);  // makes a front that needs few of the lists
  const std::uint64_t before = pool.front_nodes();
  EXPECT_GT(before, 0u);
  sway(10, 600);  // the other lists are dropped
  EXPECT_EQ(pool.front_nodes(), before);
}

// The threshold falls for a moment, as when a door opens; sources tested then are not tested for
// long.
TEST(OctreePool, TestsNoMoreSourcesForLongAfterTheThresholdFellOnce) {
  const Hall hall(2, 100'000);
  const RadiationModel radiation = hall.radiation();
  PageLoader loader(hall.trees.fetch(radiation, hall.weights), PageBudget{1'000'000'000});
  OctreePool pool(radiation, hall.weights, hall.trees.tops(), {}, loader);
  const double threshold = hall.priority_of_rank(300, radiation, {10, 1.7, 7});
  constexpr int kRound = 942;  // keyframes per round
  double path_m = 0;
  const auto walk = [&](int keyframes, double least) {
    const std::uint64_t before = pool.sources_tested();
    for (int k = 0; k < keyframes; ++k) {
      path_m += 0.02;
      const Vec3 place(10 - 3 * std::cos(path_m / 3), 1.7, 7 + 3 * std::sin(path_m / 3));
      do {
        std::vector<FoundSource> found;
        pool.refresh();
        pool.begin({place, path_m});
        pool.find_above(least, hall.all.size(), found);
        pool.request_pages(least);
      } while (!pool.complete());
    }
    return static_cast<double>(pool.sources_tested() - before) / keyframes;
  };
  walk(1, 0);  // loads all pages
  walk(200, threshold);
  const double usual = walk(kRound, threshold);
  walk(1, 1e-3 * threshold);
  walk(200, threshold);
  EXPECT_LT(walk(kRound, threshold), 1.1 * usual);
}

// The listener strolls, moves fast and returns while the threshold varies: no cached result hides a
// source.
TEST(OctreePool, FindsEverySourceOnAnyPathOfTheListener_NoAsan) {
  const Hall hall(4, 20'000);
  const RadiationModel radiation = hall.radiation();
  PageLoader loader(hall.trees.fetch(radiation, hall.weights), PageBudget{1'000'000'000});
  OctreePool pool(radiation, hall.weights, hall.trees.tops(), {}, loader);
  Vec3 place(10, 1.7, 7), home = place;
  std::size_t found_in_all = 0;
  constexpr std::uint32_t kKeyframes = 600;
  for (std::uint32_t keyframe = 0; keyframe < kKeyframes; ++keyframe) {
    const RandomBits bits = philox(6, {keyframe, 0, 0, 0}), more = philox(6, {keyframe, 1, 0, 0});
    const Vec3 step(unit(bits[0]) - 0.5, 0.2 * (unit(bits[1]) - 0.5), unit(bits[2]) - 0.5);
    const std::uint32_t in_round = keyframe % 300;
    const Vec3 before = place;
    if (in_round == 200) home = place;
    if (in_round < 200 || in_round > 230)
      place += 0.05 * step;
    else  // back and forth at another place, too fast for plans
      place = in_round == 230 ? home : home + Vec3(5, 0, in_round % 2 == 0 ? 1 : -1) + step;
    const double threshold = 0.02 * std::pow(2, -4 * std::pow(unit(bits[3]), 8) - unit(more[0]));
    std::vector<FoundSource> found;
    do {
      found.clear();
      pool.refresh();
      pool.begin({Listener(place, {}, (place - before) / 0.02), 0.02 * keyframe});
      ASSERT_TRUE(pool.find_above(threshold, hall.all.size(), found));
      pool.request_pages(threshold);
    } while (!pool.complete());
    std::vector<bool> is_found(hall.all.size());
    for (const FoundSource& one : found) is_found[one.number] = true;
    for (std::size_t s = 0; s < hall.all.size(); ++s) {
      const Source& source = hall.all[s];
      const double priority =
          weight(radiation, hall.weights.by_signal[radiation.signal(source)], source, place) /
          source.u;
      if (priority < threshold) continue;
      ++found_in_all;
      ASSERT_TRUE(is_found[s]) << keyframe << " " << s;
    }
  }
  EXPECT_GT(found_in_all, 70 * kKeyframes);
}

// An inner node without sources of its own, which a bake writes only at the root but a file may
// have anywhere; its children are too far away.
TEST(OctreePool, AcceptsInnerNodesWithoutSources) {
  SourceOctree tree;
  const auto add = [&](const Vec3f& low_m, const Vec3f& high_m, float key) {
    OctreeNode& node = tree.nodes.emplace_back();
    node.low_m = low_m;
    node.high_m = high_m;
    node.highest_key = key;
    if (low_m != high_m) return;
    Source& source = tree.sources.emplace_back();
    source.position_m = low_m;
    source.normal = source.mirror = {0, 0, -1};
    source.power = same_in_all_bands(key / kBandCount);
    source.patch_radius_m = 0.1f;
    node.first_source = static_cast<std::uint32_t>(tree.sources.size() - 1);
    node.source_count = 1;
  };
  add({0, 0, 1}, {0, 0, 1}, 1);
  add({-50, 0, 0}, {50, 0, 0}, 1e-3f);
  add({-50, 0, 0}, {-50, 0, 0}, 1e-3f);
  add({50, 0, 0}, {50, 0, 0}, 1e-3f);
  tree.nodes[0].low_m = {-50, 0, 0};
  tree.nodes[0].high_m = {50, 0, 1};
  tree.nodes[0].children[4] = 1;
  tree.nodes[1].children[0] = 2;
  tree.nodes[1].children[1] = 3;
  testing::StoredTrees trees;
  trees.add(tree);
  const std::vector<Emitter> emitters(1);
  const std::vector<Material> materials(1);
  const RadiationModel radiation(emitters, materials, Air{});
  const SignalWeights weights{{same_in_all_bands(1)}};
  PageLoader loader(trees.fetch(radiation, weights), PageBudget{1'000'000'000});
  OctreePool pool(radiation, weights, trees.tops(), {}, loader);
  std::vector<FoundSource> found;
  bool had_missed = false;
  for (int keyframe = 0; keyframe < 5; ++keyframe) {
    const Vec3 place(0, 0, 0.01 * keyframe);
    do {
      found.clear();
      pool.refresh();
      pool.begin({Listener(place, {}, {0, 0, 0.2})});
      EXPECT_TRUE(pool.find_above(1e-2, 10, found));
      had_missed = had_missed || pool.lacks_pages();
      pool.request_pages(1e-2);
    } while (!pool.complete());
    EXPECT_FALSE(pool.lacks_pages());
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].number, 0u);
  }
  EXPECT_TRUE(had_missed) << "the node was loaded before it was planned";
}

// Received power with pages down to some depth only, relative to that of all sources, per
// seed.
std::vector<double> relative_powers(int deepest, int seeds, std::uint32_t sources = 30'000) {
  std::vector<double> ratios;
  for (int seed = 0; seed < seeds; ++seed) {
    const Hall hall(100 + static_cast<std::uint64_t>(seed), sources);
    const RadiationModel radiation = hall.radiation(LateBoost(seed % 2 == 0 ? 0 : 0.6));
    PageLoader loader(hall.trees.fetch(radiation, hall.weights, deepest),
                      PageBudget{1'000'000'000});
    OctreePool pool(radiation, hall.weights, hall.trees.tops(), {}, loader);
    const auto sampler = make_priority_sampler(radiation, hall.weights, pool, 2000);
    const Vec3 place(10, 1.7, 5);
    double heard = 0;
    for (const SampledSource& one : testing::complete_sample(*sampler, place))
      heard += one.power_scale *
               weight(radiation, hall.weights.by_signal[one.signal], *one.source, place);
    ratios.push_back(heard / hall.total_power_at(radiation, place));
  }
  return ratios;
}

void expect_unbiased(const std::vector<double>& ratios, double within_db) {
  const auto count = static_cast<double>(ratios.size());
  const double mean = std::accumulate(ratios.begin(), ratios.end(), 0.0) / count;
  double squares = 0;
  std::size_t near = 0;
  for (const double ratio : ratios) {
    squares += (ratio - mean) * (ratio - mean) / (count - 1);
    near += std::abs(10 * std::log10(ratio)) <= within_db;
  }
  EXPECT_NEAR(mean, 1, 3 * std::sqrt(squares / count));
  EXPECT_GE(static_cast<double>(near), 0.95 * count);
}

TEST(OctreePool, IsUnbiasedWithItsFirstPageAlone_NoAsan) {
  expect_unbiased(relative_powers(0, 100, 10'000), 1.5);
}

// Below the first page there is one leaf that covers all octants.
TEST(OctreePool, IsUnbiasedWithoutALeafOfSeveralOctants_NoAsan) {
  constexpr std::uint32_t kSources = kNodeSources + kLeafSources - 100;
  EXPECT_EQ(Hall(100, kSources).trees.page_count(), 2u);
  expect_unbiased(relative_powers(0, 100, kSources), 1);
}

TEST(OctreePool, IsUnbiasedAndMorePreciseWithThreeLevelsOfPages_NoAsan) {
  expect_unbiased(relative_powers(2, testing::kSanitized ? 20 : 60), 0.6);
}

TEST(OctreePool, FindsNothingWithoutSources) {
  const Hall hall(1, 10);
  const RadiationModel radiation = hall.radiation();
  PageLoader loader(hall.trees.fetch(radiation, hall.weights), PageBudget{1000});
  OctreePool pool(radiation, hall.weights, {}, {}, loader);
  EXPECT_TRUE(
      make_priority_sampler(radiation, hall.weights, pool, 5)->sample(Vec3(0, 0, 0)).empty());
}

}  // namespace
}  // namespace clamor
