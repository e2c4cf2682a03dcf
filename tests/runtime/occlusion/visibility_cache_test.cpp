// visibility_cache_test.cpp: occluded sources: which are sampled, how loud they are, and when that
// is known.
#include "runtime/occlusion/visibility_cache.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/propagation/source_number.h"
#include "runtime/response/energy_response.h"
#include "runtime/sampling/sampler.h"
#include "tests/runtime/two_rooms.h"
#include "tools/strategies/all_sampler.h"

namespace clamor {
namespace {

using testing::heard;
using testing::kSpeed_mps;
using testing::two_rooms;
using testing::World;

TEST(VisibilityCache, GivesTheSampleOfAFullScanWithVisibility) {
  const World world(two_rooms(true), 150);
  constexpr std::size_t kVoices = 100;
  SourceList list(world.radiation, world.weights, world.sources);
  for (const Vec3& place : {Vec3(1, 1, 1.6), Vec3(4.5, 3.5, 1.6), Vec3(6.2, 2, 1.6),
                            Vec3(8, 3.6, 1.2), Vec3(5.3, 0.4, 0.3)}) {
    VisibilityCache occlusion(world.surfaces, kSpeed_mps,
                              {.rays_per_keyframe = 1000, .exact = true});
    const auto sampler =
        make_priority_sampler(world.radiation, world.weights, list, kVoices, &occlusion);
    const auto sample = sampler->sample(place);

    struct Entry {
      double priority, weight;
      std::uint64_t number;
    };
    std::vector<Entry> all;
    std::uint64_t rays = 0;
    for (std::uint64_t i = 0; i < world.sources.size(); ++i) {
      const Source& source = world.sources[i];
      const Bands visible =
          source_visibility(world.surfaces, kSpeed_mps, source, place, kMediumPaths, rays);
      const Bands intensity = world.radiation.intensity(source, place);
      double w = 0;
      for (std::size_t b = 0; b < kBandCount; ++b)
        w += static_cast<double>(intensity[b] * world.weights.by_signal[0][b]) * visible[b];
      if (w > 0) all.push_back({w / source.u, w, i});
    }
    std::sort(all.begin(), all.end(), [](const Entry& a, const Entry& b) {
      return a.priority != b.priority ? a.priority > b.priority : a.number < b.number;
    });
    ASSERT_GT(all.size(), kVoices);
    std::map<std::uint64_t, double> expected;
    for (std::size_t i = 0; i < kVoices; ++i)
      expected[all[i].number] = std::max(1.0, all[kVoices].priority / all[i].weight);
    ASSERT_EQ(sample.size(), kVoices);
    auto next = expected.begin();
    for (const SampledSource& one : sample) {
      EXPECT_EQ(one.number, next->first);
      EXPECT_NEAR(one.power_scale / next->second, 1, 1e-6);
      ++next;
    }
    EXPECT_LT(occlusion.statistics().estimates, world.sources.size());
  }
}

TEST(VisibilityCache, IsZeroThroughAWallWithoutTransmission_NoAsan) {
  const World world(two_rooms(false), 300);
  for (std::uint32_t i = 0; i < 6; ++i) {
    const RandomBits bits = philox(3, {i, 0, 0, 0});
    const Vec3 place(5.2 + 4.8 * unit(bits[0]), 0.1 + 3.8 * unit(bits[1]), 2.9 * unit(bits[2]));
    const auto arrivals =
        energy_response(world.sources, world.contents.emitters, world.contents.materials,
                        world.contents.settings.air, place, std::nullopt, &world.surfaces);
    EXPECT_TRUE(arrivals.empty()) << arrivals.size() << " sources are heard through the wall";
  }
}

TEST(VisibilityCache, IsZeroThroughAWallEvenIfNeighboursStandForASource_NoAsan) {
  const World world(two_rooms(false), 300);
  for (const int rays : {2000, kRaysPerKeyframe}) {
    SourceList list(world.radiation, world.weights, world.sources);
    VisibilityCache occlusion(world.surfaces, kSpeed_mps, {.rays_per_keyframe = rays});
    const auto sampler =
        make_priority_sampler(world.radiation, world.weights, list, 500, &occlusion);
    // The listener jumps from where all sources are visible to where none is.
    double before = 0;
    for (int keyframe = 0; keyframe < 10; ++keyframe) {
      const Vec3 place(1 + 0.2 * keyframe, 2, 1.6);
      const auto sample = sampler->sample(place);
      EXPECT_EQ(sample.size(), 500u);
      const auto power = heard(world, sample, place);
      before = *std::max_element(power.begin(), power.end());
    }
    for (int keyframe = 0; keyframe < 300; ++keyframe) {
      const double turn = 0.03 * keyframe;
      const Vec3 place(7.5 + 2 * std::cos(turn), 2 + 1.5 * std::sin(turn), 1.6);
      const auto power = heard(world, sampler->sample(place), place);
      // All sources are tested within a quarter of a second and stay occluded.
      const double most = *std::max_element(power.begin(), power.end());
      EXPECT_LE(most, keyframe < 12 ? 0.05 * before : 0) << "keyframe " << keyframe;
    }
  }
}

TEST(VisibilityCache, ConvergesForAListenerAtRestAndThenCostsNothing) {
  const World world(two_rooms(true), 40);
  SourceList list(world.radiation, world.weights, world.sources);
  VisibilityCache occlusion(world.surfaces, kSpeed_mps, {.rays_per_keyframe = 3000});
  const auto sampler = make_priority_sampler(world.radiation, world.weights, list, 300, &occlusion);
  const Vec3 place(6.2, 2.4, 1.6);
  std::uint64_t last = 0, most = 0;
  int keyframes = 0;
  for (;; ++keyframes) {
    sampler->sample(place);
    const std::uint64_t rays = occlusion.statistics().rays - last;
    if (rays == 0 || keyframes > 2000) break;
    most = std::max(most, rays);
    last = occlusion.statistics().rays;
  }
  EXPECT_GT(keyframes, 3);
  EXPECT_LT(keyframes, 2000);
  // A keyframe may exceed its rays by the last batch only, which may be a fine one.
  EXPECT_LT(most, 3000u + 64 * 9 * 8);
  // Each result equals the reference.
  std::uint64_t compared = 0;
  for (const SampledSource& one : sampler->sample(place)) {
    if (!is_partial(one.factors.occlusion)) continue;
    const Bands close = fine_visibility(world.surfaces, kSpeed_mps, *one.source, place);
    if (!is_partial(close)) continue;
    EXPECT_EQ(one.factors.occlusion, close);
    ++compared;
  }
  EXPECT_GT(compared, 50u);
}

TEST(VisibilityCache, ChangesTheGainOfAVoiceSmoothly) {
  const World world(two_rooms(true), 10);
  KeyframeMaker maker(world.radiation, 10);
  Keyframe keyframe;
  keyframe.voices.reserve(10);
  const Source& source = *std::find_if(world.sources.begin(), world.sources.end(),
                                       [](const Source& one) { return one.is_emitter; });
  const Listener pose{{2, 1, 1.5}, 0, 0};
  SampledSource sampled{.number = 0, .power_scale = 1, .source = &source, .signal = 0};
  maker.make({&sampled, 1}, pose, keyframe);
  ASSERT_EQ(keyframe.voices.size(), 1u);
  const float free = keyframe.voices[0].gain[0][7], low = keyframe.voices[0].gain[0][0];
  ASSERT_GT(free, 0);
  sampled.factors.occlusion = {1, 1, 1, 1, 0.5f, 0.25f, 0.1f, 0};
  float last = free;
  for (int k = 0; k < 15; ++k) {
    maker.make({&sampled, 1}, pose, keyframe);
    const float now = keyframe.voices[0].gain[0][7];
    EXPECT_LE(now, last);
    EXPECT_GT(now, 0.69f * last - 0.04f * free);  // half the power per keyframe, until it is zero
    last = now;
  }
  EXPECT_EQ(last, 0);
  EXPECT_EQ(keyframe.voices[0].gain[0][0], low);
}

// Each of 1.2 million short sources once left 170 bytes for half a minute.
TEST(VisibilityCache, ForgetsMovingSourcesThatHaveEnded) {
  const World world(two_rooms(false), 300);
  const Vec3 place(1, 1, 1.6);
  VisibilityCache occlusion(world.surfaces, kSpeed_mps, {.rays_per_keyframe = 1000});
  const auto number = [](std::uint64_t i) { return kMovingSourceBit | i << 32 | i % 20; };
  const Source& source = world.sources[0];
  constexpr std::uint64_t kPerKeyframe = 20, kKeyframes = 1000;
  for (std::uint64_t k = 0; k < kKeyframes; ++k) {
    occlusion.begin_keyframe(place);
    for (std::uint64_t i = 0; i < kPerKeyframe; ++i)
      occlusion.test_new(number(k * kPerKeyframe + i), source, 1);
  }
  std::uint64_t known = 0;
  for (std::uint64_t i = 0; i < kKeyframes * kPerKeyframe; ++i)
    known += occlusion.find(number(i)) != VisibilityCache::kUnknown;
  EXPECT_NE(occlusion.find(number(kKeyframes * kPerKeyframe - 1)), VisibilityCache::kUnknown);
  // Those of the last second, and as many again until the table is crowded.
  EXPECT_LE(known, 4 * 50 * kPerKeyframe);
}

TEST(VisibilityCache, CoversAllSourcesForStrategyAll) {
  const World world(two_rooms(true), 20);
  const SourceList list(world.radiation, world.weights, world.sources);
  VisibilityCache occlusion(world.surfaces, kSpeed_mps, {.rays_per_keyframe = 1});
  const auto sampler = make_all_sampler(world.radiation, list, &occlusion);
  std::uint64_t rays = 0;
  for (const SampledSource& one : sampler->sample(Vec3(8, 1, 1.5)))
    EXPECT_EQ(one.factors.occlusion, source_visibility(world.surfaces, kSpeed_mps, *one.source,
                                                       {8, 1, 1.5}, kMediumPaths, rays));
}

}  // namespace
}  // namespace clamor
