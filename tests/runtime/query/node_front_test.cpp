// node_front_test.cpp: samples through fronts that are kept from keyframe to keyframe, against a
// list of all sources.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/runtime/syllables.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

// Sharp lobes of two materials in a hall, from four emitters with different signals.
struct Lobes {
  explicit Lobes(std::uint32_t count, const EnvelopeSmoothing& smoothing = {}) {
    materials.resize(2);
    materials[0].phong = same_in_all_bands(3);
    materials[1].phong = same_in_all_bands(300);
    std::vector<TimedEnvelope> envelopes;
    for (std::uint32_t e = 0; e < 4; ++e) {
      emitters.emplace_back().signal = e;
      envelopes.push_back(testing::syllables(e));
    }
    weights = make_signal_weights(envelopes, smoothing);
    for (std::uint32_t i = 0; i < count; ++i) {
      const RandomBits a = philox(3, {i, 0, 0, 0}), b = philox(3, {i, 1, 0, 0});
      const RandomBits c = philox(3, {i, 2, 0, 0});
      Source& source = sources.emplace_back();
      source.position_m = Vec3f(Vec3(30 * unit(a[0]), 9 * unit(a[1]), 20 * unit(a[2])));
      const Vec3 direction(unit(c[0]) - 0.5, unit(c[1]) - 0.5, unit(c[2]) - 0.5);
      const Vec3 turned(unit(c[3]) - 0.5, unit(a[3]) - 0.5, unit(b[3]) - 0.5);
      source.normal = Vec3f(normalize(direction));
      source.mirror = Vec3f(normalize(normalize(direction) + 0.8 * turned));
      source.delay_s = static_cast<float>(0.05 + unit(b[0]));
      source.power = same_in_all_bands(static_cast<float>(std::pow(10, -5 * unit(b[0]))));
      for (std::size_t band = 0; band < kBandCount; ++band)
        if ((band < kBandCount / 2) == (b[3] % 2 == 0)) source.power[band] /= 100;
      source.u = static_cast<float>(unit_above_zero(b[1]));
      source.emitter = i % 4;
      source.material = b[2] % 8 == 0;
    }
  }
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  SignalWeights weights;
  std::vector<Source> sources;
};

// A list has no nodes and tests all of its sources each time.
TEST(NodeFront, SkipsNodesOnAWalkWithoutHidingSources) {
  const Lobes lobes(60'000);
  const RadiationModel radiation(lobes.emitters, lobes.materials, Air{});
  testing::StoredTrees trees;
  trees.add(build_octree(lobes.sources));
  SourceList list(radiation, lobes.weights, trees.all_sources());
  PageLoader loader(trees.fetch(radiation, lobes.weights), PageBudget{1'000'000'000});
  OctreePool pool(radiation, lobes.weights, trees.tops(), {}, loader);
  const auto sampler = make_priority_sampler(radiation, lobes.weights, pool, 300);
  std::uint64_t visited = 0, visited_afresh = 0;
  for (int i = 0; i < 160; ++i) {
    // The listener walks, stops, runs, and jumps back in place and time.
    const double path_m = i < 60 ? 0.03 * i : i < 90 ? 1.8 : 1.8 + 0.15 * (i - 90);
    const double time_s = i < 150 ? 3 + 0.02 * i : 3 + 0.02 * (i - 150);
    const Vec3 place(8 + path_m, 1.7, 9 + 2 * std::sin(path_m));
    const std::uint64_t before = pool.nodes_visited();
    auto sample = sampler->sample(place, time_s);
    while (!sampler->complete()) sample = sampler->sample(place, time_s);
    visited += pool.nodes_visited() - before;
    if (i % 5 != 0) continue;
    const auto afresh = make_priority_sampler(radiation, lobes.weights, list, 300);
    const auto expected = afresh->sample(place, time_s);
    ASSERT_EQ(sample.size(), expected.size()) << i;
    for (std::size_t s = 0; s < sample.size(); ++s) {
      ASSERT_EQ(sample[s].number, expected[s].number) << i;
      ASSERT_NEAR(sample[s].power_scale / expected[s].power_scale, 1, 1e-9) << i;
    }
    OctreePool other(radiation, lobes.weights, trees.tops(), {}, loader);
    const auto stranger = make_priority_sampler(radiation, lobes.weights, other, 300);
    stranger->sample(place, time_s);
    const std::uint64_t first = other.nodes_visited();
    // The second query knows the threshold, but nothing that helps at another place.
    stranger->sample(place + Vec3(0, 0, 40), time_s - 1);
    const std::uint64_t second = other.nodes_visited();
    stranger->sample(place, time_s - 1);
    visited_afresh += 5 * std::min(first, other.nodes_visited() - second);
  }
  EXPECT_LT(2 * visited, visited_afresh);
}

// Walks through the hall and compares the pool's sample with the list's in each keyframe. All
// requested pages arrive between two keyframes, so nothing depends on the scheduling of threads.
struct ComparedWalk {
  std::uint64_t planned = 0, planned_while_pages_came = 0, dropped = 0;
  std::size_t keyframes_that_differ = 0;
};
ComparedWalk compared_walk(const Lobes& lobes, std::uint64_t page_bytes,
                           const std::function<Vec3(int)>& place_at) {
  const RadiationModel radiation(lobes.emitters, lobes.materials, Air{});
  testing::StoredTrees trees;
  trees.add(build_octree(lobes.sources));
  SourceList list(radiation, lobes.weights, trees.all_sources());
  PageLoader loader(trees.fetch(radiation, lobes.weights), PageBudget{page_bytes, false});
  OctreePool pool(radiation, lobes.weights, trees.tops(), {}, loader);
  const auto sampler = make_priority_sampler(radiation, lobes.weights, pool, 300);
  const auto by_list = make_priority_sampler(radiation, lobes.weights, list, 300);
  ComparedWalk walk;
  for (int i = 0; i < 200; ++i) {
    const Vec3 place = place_at(i);
    const double time_s = 3 + 0.02 * i;
    const std::uint64_t planned = pool.front_nodes(), loaded = loader.statistics().loaded;
    auto sample = sampler->sample(place, time_s);
    while (!sampler->complete()) sample = sampler->sample(place, time_s);
    if (loader.statistics().loaded > loaded)
      walk.planned_while_pages_came += pool.front_nodes() - planned;
    const auto expected = by_list->sample(place, time_s);
    walk.keyframes_that_differ += !std::equal(
        sample.begin(), sample.end(), expected.begin(), expected.end(),
        [](const SampledSource& a, const SampledSource& b) {
          return a.number == b.number && std::abs(a.power_scale / b.power_scale - 1) < 1e-9;
        });
    loader.wait();
  }
  walk.planned = pool.front_nodes();
  walk.dropped = loader.statistics().dropped;
  return walk;
}

// Walks back and forth, with a jump to the other end of the hall and back.
Vec3 to_and_fro(int i) {
  const double path_m = 0.03 * i;
  return {i >= 100 && i < 110 ? 26 : 5 + path_m, 1.7, 9 + 4 * std::sin(path_m)};
}

// Pages arrive while a plan is made and used, and the plan ends where they are evicted.
TEST(NodeFront, HidesNothingWhilePagesComeAndGo) {
  // The thresholds follow every syllable.
  const ComparedWalk walk = compared_walk(Lobes(60'000, {0, 0, 0}), 3'000'000, to_and_fro);
  EXPECT_EQ(walk.keyframes_that_differ, 0u);
  EXPECT_GT(walk.planned_while_pages_came, 0u);
  EXPECT_GT(walk.dropped, 100u);
}

// The thresholds hardly change, so a plan is used for as long as it is valid.
TEST(NodeFront, HidesNothingWithSteadySignals_NoAsan) {
  Lobes lobes(60'000);
  for (const bool smoothed : {true, false}) {
    if (!smoothed) lobes.weights.tracks.clear();
    for (const std::uint64_t page_bytes : {3'000'000, 1'000'000'000}) {
      const ComparedWalk walk = compared_walk(lobes, page_bytes, to_and_fro);
      EXPECT_EQ(walk.keyframes_that_differ, 0u) << smoothed << " " << page_bytes;
      EXPECT_GT(walk.planned_while_pages_came, 0u) << smoothed << " " << page_bytes;
      EXPECT_EQ(walk.dropped > 0, page_bytes < 1'000'000'000) << smoothed << " " << page_bytes;
    }
  }
}

// A shortlist is valid within a ball that is smaller than a few such steps.
TEST(NodeFront, HidesNothingFromAFastListener_NoAsan) {
  Lobes lobes(60'000);
  lobes.weights.tracks.clear();
  for (const double step_m : {0.03, 0.07, 0.08, 0.1, 0.15, 0.24, 0.26}) {
    const ComparedWalk walk = compared_walk(lobes, 1'000'000'000, [step_m](int i) {
      const double path_m = step_m * i, radius_m = 5;
      return Vec3(15 + radius_m * std::cos(path_m / radius_m), 1.7,
                  10 + radius_m * std::sin(path_m / radius_m));
    });
    EXPECT_EQ(walk.keyframes_that_differ, 0u) << step_m;
    EXPECT_GT(walk.planned, 0u) << step_m;
  }
}

}  // namespace
}  // namespace clamor
