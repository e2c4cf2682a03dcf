// visibility_cache_door_test.cpp: occlusion for a listener who walks through a door, and the sample
// that follows from it.
#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include <gtest/gtest.h>

#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/query/octree_pool.h"
#include "tests/runtime/occlusion/visibility_reference.h"
#include "tests/runtime/priority_sample_reference.h"
#include "tests/runtime/two_rooms.h"
#include "tests/sanitized.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

using testing::kSpeed_mps;
using testing::two_rooms;
using testing::World;

// Speech-like levels that vary at random over 30 dB.
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

using Power = std::array<double, kBandCount>;

// Received power of all sources, each with the given visibility per band.
template <class Visibility>
Power power_of_all(const World& world, const Vec3& place, const Visibility& visibility) {
  Power power{};
  for (const Source& source : world.sources) {
    const Bands intensity = world.radiation.intensity(source, place);
    if (intensity == Bands{}) continue;
    const Power visible = visibility(source);
    for (std::size_t b = 0; b < kBandCount; ++b)
      power[b] += static_cast<double>(intensity[b]) * visible[b];
  }
  return power;
}

// At least 10 000 rays per source.
Power long_reference(const World& world, const Vec3& place) {
  constexpr std::uint32_t kWays = 310;  // per band
  std::uint64_t rays = 0, looked_at = 0;
  const Power power = power_of_all(world, place, [&](const Source& source) {
    Power visible{};
    const auto start_m = world.surfaces.ray_origin(source);
    if (!start_m) return visible;
    ++looked_at;
    for (std::size_t b = 0; b < kBandCount; ++b)
      visible[b] = testing::slow_visibility(world.surfaces, {*start_m, Vec3f(place), kSpeed_mps}, b,
                                            kWays, rays);
    return visible;
  });
  EXPECT_GE(rays, 10'000 * looked_at) << place.x;
  return power;
}

// Uses the fine test with a tenth of the rays, for thousands of sources.
Power close_reference(const World& world, const Vec3& place) {
  return power_of_all(world, place, [&](const Source& source) {
    Power visible{};
    std::ranges::copy(fine_visibility(world.surfaces, kSpeed_mps, source, place), visible.begin());
    return visible;
  });
}

// The listener walks at 1.5 m/s from the room with the emitter through the door, reached at
// keyframes 66 to 70, and aside into the other room.
Vec3 through_the_door(int keyframe) {
  const double path_m = 0.03 * keyframe;
  if (path_m < 3.5) return {3 + path_m, 2, 1.6};
  return {6.5 + 0.5 * (path_m - 3.5), 2 + 0.85 * (path_m - 3.5), 1.6};
}

// A sound level meter with time weighting F (IEC 61672-1).
class FastLevel {
 public:
  explicit FastLevel(double step_s) : share_(1 - std::exp(-step_s / 0.125)) {}

  void add(const Power& power) {
    for (std::size_t b = 0; b < kBandCount; ++b)
      mean_[b] += (begun_ ? share_ : 1) * (power[b] - mean_[b]);
    begun_ = true;
  }
  double db(std::size_t band) const { return 10 * std::log10(mean_[band]); }

 private:
  const double share_;
  bool begun_ = false;
  Power mean_{};
};

// Compares every `every` keyframes from `first` to `last`.
template <class Reference>
void expect_as_a_reference_through_a_door(std::uint64_t photons, std::size_t min_sources,
                                          const Reference& reference, int first, int last,
                                          int every) {
  const World world(two_rooms(true), photons);
  ASSERT_GT(world.sources.size(), min_sources);
  SourceList list(world.radiation, world.weights, world.sources);
  VisibilityCache occlusion(world.surfaces, kSpeed_mps, {});
  // All sources are voices, so only visibility differs from the reference.
  const auto sampler =
      make_priority_sampler(world.radiation, world.weights, list, world.sources.size(), &occlusion);
  FastLevel is(0.02 * every), should_be(0.02 * every);
  double fell_db = 0;
  for (int keyframe = 0; keyframe <= last; ++keyframe) {
    const Vec3 place = through_the_door(keyframe);
    const auto sample = sampler->sample(place);
    if (keyframe < first || (keyframe - first) % every != 0) continue;
    is.add(heard(world, sample, place));
    should_be.add(reference(world, place));
    for (std::size_t b = 0; b < kBandCount; ++b)
      // The lowest band falls while the listener is in the door, and is 1.6 dB late once.
      EXPECT_NEAR(is.db(b) - should_be.db(b), 0, b == 0 ? 1.75 : 1.5)
          << "band " << b << " at " << place.x << ", " << place.y;
    if (keyframe == first) fell_db = should_be.db(5);
  }
  EXPECT_GT(fell_db - should_be.db(5), 4);  // the other room is quieter
}

TEST(VisibilityCache, IsWithinOneAndAHalfDecibelsOfALongReferenceThroughADoor) {
  expect_as_a_reference_through_a_door(40, 500, long_reference, 58, 110, 26);
}

// With thousands of sources, rays do not suffice to test each again before the door is passed.
TEST(VisibilityCache, OfThousandsOfSourcesIsAsCloseToAReference_NoAsan) {
  expect_as_a_reference_through_a_door(500, 7000, close_reference, 58, 110,
                                       testing::kSanitized ? 52 : 16);
}

// There are no rays for re-tests, so cached visibilities stay constant.
TEST(VisibilityCache, DeterminesTheSampleOfAnOctree) {
  World world(two_rooms(true), 300);
  world.weights = make_signal_weights(std::vector(world.contents.signals.size(), speech()));
  testing::StoredTrees trees;
  trees.add(build_octree(world.sources));
  const std::vector<Source> all = trees.all_sources();
  constexpr std::size_t kVoices = 200;
  PageLoader loader(trees.fetch(world.radiation, world.weights), PageBudget{100'000'000});
  OctreePool pool(world.radiation, world.weights, trees.tops(), {}, loader);
  VisibilityCache occlusion(world.surfaces, kSpeed_mps, {.rays_per_keyframe = 0, .exact = true});
  const auto sampler =
      make_priority_sampler(world.radiation, world.weights, pool, kVoices, &occlusion);
  std::uint64_t hidden = 0, exchanged = 0;
  std::set<std::uint64_t> before;
  for (int keyframe = 0; keyframe < 150; ++keyframe) {
    // The listener walks, then flies, and returns to places with cached visibilities.
    const double path_m = keyframe < 100 ? 0.03 * keyframe : 0.6 * (keyframe - 100);
    const Vec3 place(5 + 4 * std::cos(0.3 * path_m), 2 + 1.5 * std::sin(path_m), 1.6);
    const double time_s = 10 + 0.02 * keyframe;
    auto sample = sampler->sample(place, time_s);
    while (!sampler->complete()) sample = sampler->sample(place, time_s);

    std::vector<testing::WeightedSource> known;
    double unknown = 0;
    for (std::uint64_t i = 0; i < all.size(); ++i) {
      const auto now = weights_at_place(world.radiation, world.weights,
                                        world.radiation.signal(all[i]), all[i], place, time_s);
      const Bands intensity = world.radiation.intensity(all[i], place);
      const auto index = occlusion.find(i);
      const bool is_known = index != VisibilityCache::kUnknown;
      const Bands visible = is_known ? occlusion.visibility(index) : same_in_all_bands(1);
      double w = 0;
      for (std::size_t b = 0; b < kBandCount; ++b)
        w += static_cast<double>(now.weights[b] * intensity[b]) * visible[b];
      if (is_known && w > 0)
        known.push_back({i, w, all[i].u});
      else
        unknown = std::max(unknown, w / all[i].u);
      hidden += is_known && w == 0;
    }
    const auto expected = testing::reference_sample(known, kVoices);
    ASSERT_EQ(expected.size(), kVoices);
    std::ranges::nth_element(known, known.begin() + kVoices, std::greater(),
                             &testing::WeightedSource::priority);
    const double tau = known[kVoices].priority();
    // Every source that might have been chosen has been tested.
    EXPECT_LE(unknown, tau * (1 + 1e-6)) << keyframe;
    testing::expect_sample(sample, expected, 1e-5);
    if (HasFatalFailure()) FAIL() << "keyframe " << keyframe;
    std::set<std::uint64_t> chosen;
    for (const SampledSource& one : sample) {
      chosen.insert(one.number);
      exchanged += !before.contains(one.number);
    }
    before = std::move(chosen);
  }
  // The test is sensitive: some sources are occluded in each keyframe, and many enter and leave the
  // sample.
  EXPECT_GT(hidden, 150u * 20u);
  EXPECT_GT(exchanged, 1000u);
}

}  // namespace
}  // namespace clamor
