// A listener who walks through a door: what is heard then, and that it is chosen exactly by what is
// known.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "bake/octree_builder.h"
#include "common/random.h"
#include "runtime/energy_response.h"
#include "runtime/octree_pool.h"
#include "runtime/visibility_cache.h"
#include "tests/runtime/two_rooms.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

using testing::heard;
using testing::kSpeed_mps;
using testing::two_rooms;
using testing::World;

// Loud and low by turns, at random, over 30 dB.
TimedEnvelope speech() {
  constexpr std::size_t kMoments = 400;
  std::vector<std::uint8_t> steps(kBandCount * kMoments);
  for (std::uint32_t m = 0; m < kMoments; ++m) {
    const double level = 255 - 60 * unit(philox(8, {m / 6, 0, 0, 0})[0]);
    for (std::size_t b = 0; b < kBandCount; ++b)
      steps[b * kMoments + m] =
          static_cast<std::uint8_t>(m == 0 ? 255 : level - 4 * static_cast<double>(b));
  }
  return {*SignalEnvelope::from_steps(same_in_all_bands(1), std::move(steps)),
          kMoments * kMomentFrames, true};
}

void expect_as_a_reference_through_a_door(std::uint64_t photons, std::size_t least_sources,
                                          int first, int last) {
  const World world(two_rooms(true), photons);
  ASSERT_GT(world.sources.size(), least_sources);
  SourceList list(world.field, world.weights, world.sources);
  VisibilityCache sight(world.surfaces, kSpeed_mps, {});
  // All sources are voices: what differs from the reference is what is known of their visibility.
  const auto sampler =
      make_priority_sampler(world.field, world.weights, list, world.sources.size(), &sight);
  int compared = 0;
  // From the lit room through the door and aside into the other, at 1.5 m/s.
  const auto walk = [](double way_m) {
    if (way_m < 3.5) return Vec3(3 + way_m, 2, 1.6);
    return Vec3(6.5 + 0.5 * (way_m - 3.5), 2 + 0.85 * (way_m - 3.5), 1.6);
  };
  for (int keyframe = 0; keyframe < 175; ++keyframe) {
    const Vec3 place = walk(0.03 * keyframe);
    const auto sample = sampler->sample(place);
    if (keyframe % 25 != 24 || keyframe < first || keyframe > last) continue;
    std::array<double, kBandCount> reference{};
    for (const Arrival& arrival :
         energy_response(world.sources, world.contents.emitters, world.contents.materials,
                         world.contents.settings.air, place, std::nullopt, &world.surfaces))
      for (std::size_t b = 0; b < kBandCount; ++b) reference[b] += arrival.energy[b];
    const auto now = heard(world, sample, place);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double off_db = 10 * std::log10(now[b] / reference[b]);
      EXPECT_NEAR(off_db, 0, 1.5) << "band " << b << " at " << place.x << ", " << place.y;
      ++compared;
    }
  }
  EXPECT_EQ(compared, 8 * ((last + 1) / 25 - first / 25));
}

TEST(Visibility, FollowsALongReferenceThroughADoorWithin1_5DecibelsPerBand) {
  expect_as_a_reference_through_a_door(40, 500, 0, 175);
}

// Then there are not enough rays to look at each of them again before the door is passed.
TEST(Visibility, OfThousandsOfSourcesFollowsThatReferenceAsClosely) {
  expect_as_a_reference_through_a_door(400, 7000, 49, 124);
}

// Looks that never come to their turn: so that what is known of a source stays what it was.
TEST(Visibility, KnownToTheCacheIsWhatAWalkThroughAnOctreeChoosesBy) {
  World world(two_rooms(true), 300);
  world.weights = make_signal_weights(std::vector(world.contents.signals.size(), speech()));
  testing::StoredTrees trees;
  trees.add(build_octree(world.sources));
  const std::vector<Source> all = trees.all_sources();
  constexpr std::size_t kVoices = 200;
  PageLoader loader(trees.fetch(world.field, world.weights), PageBudget{100'000'000});
  OctreePool pool(world.field, world.weights, trees.tops(), {}, loader);
  VisibilityCache sight(world.surfaces, kSpeed_mps, {.rays_per_keyframe = 0, .exact = true});
  const auto sampler = make_priority_sampler(world.field, world.weights, pool, kVoices, &sight);
  std::uint64_t hidden = 0, exchanged = 0;
  std::set<std::uint64_t> before;
  for (int keyframe = 0; keyframe < 150; ++keyframe) {
    // Steps of a walk; then of one who flies, and back to where something is known.
    const double way_m = keyframe < 100 ? 0.03 * keyframe : 0.6 * (keyframe - 100);
    const Vec3 place(5 + 4 * std::cos(0.3 * way_m), 2 + 1.5 * std::sin(way_m), 1.6);
    const double time_s = 10 + 0.02 * keyframe;
    auto sample = sampler->sample(place, time_s);
    while (!sampler->complete()) sample = sampler->sample(place, time_s);

    struct Ranked {
      double priority, weight;
      std::uint64_t number;
    };
    std::vector<Ranked> known;
    double unknown = 0;
    for (std::uint64_t i = 0; i < all.size(); ++i) {
      const auto now = weights_now(world.field, world.weights, world.field.signal(all[i]), all[i],
                                   place, time_s);
      const Bands intensity = world.field.intensity(all[i], place);
      const auto index = sight.find(i);
      const bool is_known = index != VisibilityCache::kUnknown;
      const Bands visible = is_known ? sight.visibility(index) : same_in_all_bands(1);
      double w = 0;
      for (std::size_t b = 0; b < kBandCount; ++b)
        w += static_cast<double>(now.weights[b] * intensity[b]) * visible[b];
      if (is_known && w > 0)
        known.push_back({w / all[i].u, w, i});
      else
        unknown = std::max(unknown, w / all[i].u);
      hidden += is_known && w == 0;
    }
    std::sort(known.begin(), known.end(),
              [](const Ranked& a, const Ranked& b) { return a.priority > b.priority; });
    ASSERT_GT(known.size(), kVoices);
    const double tau = known[kVoices].priority;
    // Nobody was left unknown who might have been chosen.
    EXPECT_LE(unknown, tau * (1 + 1e-6)) << keyframe;
    std::map<std::uint64_t, double> expected;
    for (std::size_t i = 0; i < kVoices; ++i)
      expected[known[i].number] = std::max(1.0, tau / known[i].weight);
    ASSERT_EQ(sample.size(), kVoices) << keyframe;
    std::set<std::uint64_t> chosen;
    for (const SampledSource& one : sample) {
      ASSERT_TRUE(expected.contains(one.number)) << one.number << " at keyframe " << keyframe;
      EXPECT_NEAR(one.power_scale / expected[one.number], 1, 1e-5);
      chosen.insert(one.number);
      exchanged += !before.contains(one.number);
    }
    before = std::move(chosen);
  }
  // It was worth the while: some are hidden in each keyframe, and much comes and goes.
  EXPECT_GT(hidden, 150u * 20u);
  EXPECT_GT(exchanged, 1000u);
}

}  // namespace
}  // namespace clamor
