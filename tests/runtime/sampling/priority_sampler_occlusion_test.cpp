// priority_sampler_occlusion_test.cpp: cost and result of sampling for listeners from whom nearly
// everything is occluded.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "bake/octree/octree_builder.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/runtime/two_rooms.h"
#include "tests/sanitized.h"
#include "tests/source_lists.h"
#include "tests/stored_tree.h"
#include "tools/analysis/sampled_response.h"

namespace clamor {
namespace {

using testing::heard;
using testing::World;

using Place = std::function<Vec3(int keyframe)>;

double sum_of_bands(const std::array<double, kBandCount>& power) {
  return std::accumulate(power.begin(), power.end(), 0.0);
}

double db(double power) { return 10 * std::log10(power + 1e-30); }

// A sampler with occlusion of the sources of a world, or of other sources on the walls of its room,
// in an octree.
class OccludedListener {
 public:
  OccludedListener(const World& world, std::vector<Source> sources, std::size_t voices, bool exact)
      : world_(world) {
    trees_.add(build_octree(std::move(sources)));
    loader_ = std::make_unique<PageLoader>(trees_.fetch(world.radiation, world.weights),
                                           PageBudget{4'000'000'000});
    pool_ = std::make_unique<OctreePool>(world.radiation, world.weights, trees_.tops(),
                                         std::span<const std::vector<std::uint32_t>>(), *loader_);
    occlusion_ = std::make_unique<VisibilityCache>(world.surfaces, testing::kSpeed_mps,
                                                   VisibilityOptions{.exact = exact});
    sampler_ =
        make_priority_sampler(world.radiation, world.weights, *pool_, voices, occlusion_.get(),
                              exact ? SearchBound::kUnbounded : SearchBound::kBounded);
  }

  // All requested pages arrive before the next keyframe.
  double power_at(const Vec3& place, double time_s) {
    const std::uint64_t work = sampler_->work(), rays = occlusion_->statistics().rays;
    auto sample = sampler_->sample(place, time_s);
    if (!occlusion_->exact()) {
      work_ = sampler_->work() - work;
      rays_ = occlusion_->statistics().rays - rays;
      loader_->wait();
    } else {
      while (!sampler_->complete()) sample = sampler_->sample(place, time_s);
    }
    return sum_of_bands(heard(world_, sample, place));
  }

  std::uint64_t work() const { return work_; }  // of the last keyframe
  std::uint64_t rays() const { return rays_; }
  Sampler& sampler() { return *sampler_; }
  const VisibilityCache& occlusion() const { return *occlusion_; }

 private:
  const World& world_;
  testing::StoredTrees trees_;
  std::unique_ptr<PageLoader> loader_;
  std::unique_ptr<OctreePool> pool_;
  std::unique_ptr<VisibilityCache> occlusion_;
  std::unique_ptr<Sampler> sampler_;
  std::uint64_t work_ = 0, rays_ = 0;
};

// A closed box with a solid pillar of 0.4 m in it.
Level box_with_pillar(const Vec3& size_m) {
  Level level = testing::shoebox(size_m, testing::uniform_material(0.1f), {1.5, 1.7, 1.5});
  const Mesh pillar = testing::box({0.4, size_m.y, 0.4});
  const auto first = static_cast<std::uint32_t>(level.mesh.vertices_m.size());
  for (const Vec3f& vertex_m : pillar.vertices_m)
    level.mesh.vertices_m.push_back(vertex_m + Vec3f(4, 0, 2));
  for (const auto& corners : pillar.triangles)
    level.mesh.triangles.push_back({first + corners[0], first + corners[1], first + corners[2]});
  level.mesh.materials.insert(level.mesh.materials.end(), pillar.triangles.size(), 0);
  return level;
}

// The listener walks inside for two seconds, jumps to a place where little is audible for two, and
// returns. The budget counts units of work, so the bound does not depend on the machine.
void expect_bounded_and_back_soon(const World& world, const std::vector<Source>& sources,
                                  const Place& inside, const Place& hidden, bool is_silent) {
  constexpr std::size_t kVoices = 2000;
  constexpr int kLeaves = 100, kReturns = 200, kBackWithin = 10;
  // A query notices an exhausted budget after at most a packet of pages.
  const std::uint64_t max_work =
      (work_per_keyframe(kVoices) + work_ahead_per_keyframe(kVoices)) * 5 / 4;
  // Twice the rays where everything changed, plus the last batch, which may be a fine one.
  constexpr std::uint64_t kMaxRays = 2 * kRaysPerKeyframe + 64 * 9 * 8;
  OccludedListener listener(world, sources, kVoices, false);
  std::vector<double> settled(50);  // by position on the path
  for (int keyframe = 0; keyframe < kReturns + 30; ++keyframe) {
    const bool is_hidden = keyframe >= kLeaves && keyframe < kReturns;
    const Vec3 place = is_hidden ? hidden(keyframe) : inside(keyframe % 50);
    const double power = listener.power_at(place, 0.02 * keyframe);
    EXPECT_LE(listener.work(), max_work) << "keyframe " << keyframe;
    EXPECT_LE(listener.rays(), kMaxRays) << "keyframe " << keyframe;
    if (keyframe < kLeaves) settled[keyframe % 50] = power;
    if (keyframe == kReturns - 1 && is_silent) {
      EXPECT_LT(db(power), db(settled[0]) - 40);
      EXPECT_GT(listener.sampler().bounded_keyframes(), 0u);
    }
    if (keyframe >= kReturns + kBackWithin) {
      EXPECT_NEAR(db(power) - db(settled[keyframe % 50]), 0, 1) << "keyframe " << keyframe;
    }
  }
}

// Both rooms are small, so a step is 3 cm.
Vec3 stroll(const Vec3& from, int keyframe) {
  return from + Vec3(0.03 * (keyframe % 50), 0, 0.01 * (keyframe % 50));
}

TEST(OccludedListener, StaysWithinTheBudgetAndRecoversAtOnce_NoAsan) {
  const World world(box_with_pillar({6, 4, 5}), testing::kSanitized ? 100 : 1500);
  const auto inside = [](int k) { return stroll({2, 1.7, 3}, k); };
  const auto outside = [](int k) { return stroll({9, 1.7, 2}, k); };
  const auto in_the_pillar = [](int k) { return stroll({4.05, 1.7, 2.1}, k / 40); };
  expect_bounded_and_back_soon(world, world.sources, inside, outside, true);
  expect_bounded_and_back_soon(world, world.sources, inside, in_the_pillar, true);
}

TEST(OccludedListener, StaysWithinTheBudgetBehindAWall) {
  Level level = testing::shoebox({12, 3, 8}, testing::uniform_material(0.6f), {1.5, 1.5, 4});
  testing::add_quad(level.mesh,
                    {Vec3f(6, 0, 0.5f), Vec3f(6, 3, 0.5f), Vec3f(6, 3, 7.5f), Vec3f(6, 0, 7.5f)});
  const World world(level, testing::kSanitized ? 100 : 2500);
  expect_bounded_and_back_soon(
      world, world.sources,
      [](int k) {
        return stroll({3, 1.5, 3}, k);
      },
      [](int k) {
        return stroll({6.3, 1.5, 3.5}, k);
      },
      false);
}

TEST(OccludedListener, StaysWithinTheBudgetWithAMillionSources_NoAsan) {
  const World world(box_with_pillar({20, 8, 15}), 5);
  std::vector<Source> sources = testing::wall_sources(testing::kSanitized ? 20'000 : 1'000'000);
  expect_bounded_and_back_soon(
      world, sources,
      [](int k) {
        return stroll({8, 1.7, 7}, k);
      },
      [](int k) {
        return stroll({26, 1.7, 7}, k);
      },
      true);
}

TEST(OccludedListener, TestsEachSourceOnceInARender) {
  const World world(box_with_pillar({6, 4, 5}), 200);
  OccludedListener listener(world, world.sources, 2000, true);
  EXPECT_GT(listener.power_at({2, 1.7, 3}, 0), 0);
  const std::uint64_t looks = listener.occlusion().statistics().estimates;
  for (int keyframe = 1; keyframe < 5; ++keyframe)
    EXPECT_EQ(listener.power_at({9 + 0.01 * keyframe, 1.7, 2}, 0.02 * keyframe), 0);
  EXPECT_LE(listener.occlusion().statistics().estimates - looks, world.sources.size());
}

// Half of the sources are silent, so that a sample of nearly all sources never has as many.
TEST(OccludedListener, AsksForAllSourcesAtOnceAfterASampleThatHadTooFew) {
  const World world(box_with_pillar({6, 4, 5}), 200);
  std::vector<Source> sources = world.sources;
  for (std::size_t i = 0; i < sources.size(); i += 2) sources[i].power = same_in_all_bands(1e-25f);
  const auto work_of_a_step = [&](std::size_t voices) {
    OccludedListener listener(world, sources, voices, false);
    for (int keyframe = 0; keyframe < 10; ++keyframe)
      listener.power_at(stroll({2, 1.7, 3}, keyframe), 0.02 * keyframe);
    return listener.work();
  };
  EXPECT_LE(work_of_a_step(sources.size() - 1), 1.1 * work_of_a_step(sources.size()));
}

// A load control may ask for more sources than there are that can be heard.
TEST(OccludedListener, TakesAllThatIsLeftWhereALowerThresholdFindsHardlyMore) {
  const World world(box_with_pillar({6, 4, 5}), 200);
  std::vector<Source> sources = world.sources;
  for (std::size_t i = 0; i < sources.size(); i += 2) sources[i].power = same_in_all_bands(1e-25f);
  OccludedListener listener(world, sources, sources.size() - 1, false);
  listener.sampler().set_voice_count(sources.size() / 3);
  for (int keyframe = 0; keyframe < 20; ++keyframe)
    listener.power_at(stroll({2, 1.7, 3}, keyframe), 0.02 * keyframe);
  listener.sampler().set_voice_count(sources.size() - 1);
  listener.power_at(stroll({2, 1.7, 3}, 20), 0.4);
  EXPECT_LT(listener.work(), work_per_keyframe(sources.size() - 1) / 2);
  EXPECT_EQ(listener.sampler().bounded_keyframes(), 0u);
}

TEST(OccludedListener, StopsSearchingWhenAsked) {
  const World world(box_with_pillar({6, 4, 5}), 200);
  for (const bool exact : {false, true}) {
    OccludedListener listener(world, world.sources, 2000, exact);
    listener.power_at({2, 1.7, 3}, 0);
    const std::uint64_t work = listener.sampler().work(),
                        looks = listener.occlusion().statistics().rays;
    const std::atomic<bool> stop{true};
    listener.sampler().stop_when(&stop);
    listener.sampler().sample(Vec3(9, 1.7, 2), 0.02);
    // A query notices the request after a page or two.
    EXPECT_LE(listener.sampler().work() - work, 20'000u) << exact;
    EXPECT_LE(listener.occlusion().statistics().rays - looks, kRaysPerKeyframe) << exact;
    listener.sampler().stop_when(nullptr);
  }
}

// A hall of little reverberation, with a wall of 4 x 3 m between its emitter and the listener.
Level hall_with_wall() {
  Level level = testing::shoebox({24, 8, 14}, testing::uniform_material(0.95f), {12, 1.5, 11});
  testing::add_quad(level.mesh,
                    {Vec3f(10, 0, 8), Vec3f(14, 0, 8), Vec3f(14, 3, 8), Vec3f(10, 3, 8)});
  return level;
}

// A list of sources each of whose queries costs a quarter of a keyframe's budget.
class CostlyPool final : public SourcePool {
 public:
  CostlyPool(const World& world, std::size_t voices)
      : list_(world.radiation, world.weights, world.sources),
        cost_(work_per_keyframe(voices) / 4) {}

  void begin(const QueryKeyframe& keyframe) override { list_.begin(keyframe); }
  bool find_above(double threshold, std::size_t max_count,
                  std::vector<FoundSource>& found) override {
    spend(cost_);
    return list_.find_above(threshold, max_count, found) && !is_exhausted();
  }
  double upper_bound() override { return list_.upper_bound() + 1e6; }
  std::uint64_t size() const override { return list_.size(); }

 private:
  SourceList list_;
  const std::uint64_t cost_;
};

// Too few sources above a threshold do not mean that the others are occluded.
TEST(OccludedListener, HearsAllVoicesWhereNothingIsOccludedHoweverCostlyAQueryIs) {
  constexpr std::size_t kVoices = 500;
  const World world(testing::shoebox({6, 4, 5}, testing::uniform_material(0.1f), {1.5, 1.7, 1.5}),
                    1000);
  ASSERT_GT(world.sources.size(), 10 * kVoices);
  CostlyPool pool(world, kVoices);
  VisibilityCache occlusion(world.surfaces, testing::kSpeed_mps, {});
  const auto sampler = make_priority_sampler(world.radiation, world.weights, pool, kVoices,
                                             &occlusion, SearchBound::kBounded);
  std::size_t size = 0;
  for (int keyframe = 0; keyframe < 100; ++keyframe)
    size = sampler->sample(Listener{{4, 1.7, 3}, 0, 0}, 0.02 * keyframe).size();
  EXPECT_GE(size, kVoices);
}

// The listener walks behind the wall. The sources that are named are then as loud as in a new
// sample, and the others as before.
TEST(RenderedOcclusion, IsRenewedForSomeSourcesBetweenSamples_NoAsan) {
  const World world(hall_with_wall(), 300);
  const Vec3 first(4, 1.5, 6.5), behind(13.5, 1.5, 6.5);
  OccludedListener walking(world, world.sources, 10'000, true);
  OccludedListener anew(world, world.sources, 10'000, true);
  walking.power_at(first, 0);
  anew.power_at(behind, 0);
  const auto sample = walking.sampler().sample(first, 0);
  const std::vector<SampledSource> before(sample.begin(), sample.end());
  std::vector<std::uint64_t> named;
  for (std::size_t i = 0; i < before.size(); i += 2) named.push_back(before[i].number);
  walking.sampler().renew(named, behind);
  const auto power_of_named = [&](std::span<const SampledSource> of) {
    std::vector<SampledSource> all;
    for (const SampledSource& one : of)
      if (std::ranges::binary_search(named, one.number)) all.push_back(one);
    return db(sum_of_bands(heard(world, all, behind)));
  };
  const double should_be = power_of_named(anew.sampler().sample(behind, 0));
  EXPECT_GT(power_of_named(before), should_be + 3);
  EXPECT_NEAR(power_of_named(sample), should_be, 1);
  for (std::size_t i = 1; i < before.size(); i += 2)
    EXPECT_EQ(sample[i].factors.occlusion, before[i].factors.occlusion);
}

TEST(RenderedOcclusion, FollowsTheShadowOfAWallAtAnySpeed_NoAsan) {
  const World world(hall_with_wall(), 300);
  constexpr std::size_t kVoices = 300;
  for (const double speed_mps : {3.0, 9.0}) {
    OccludedListener listener(world, world.sources, kVoices, true);
    const int keyframes = static_cast<int>(16 / (0.02 * speed_mps));
    double most = 0, least = 1e9, worst_db = 0;
    for (int keyframe = 0; keyframe < keyframes; ++keyframe) {
      const Vec3 place(4 + 0.02 * speed_mps * keyframe, 1.5, 6.5);
      const double power = listener.power_at(place, 0.02 * keyframe);
      most = std::max(most, power);
      least = std::min(least, power);
      if (keyframe % (testing::kSanitized ? 32 : 4) != 0) continue;
      // A new sampler has no cache and tests every source from here.
      OccludedListener anew(world, world.sources, kVoices, true);
      const double should_be = anew.power_at(place, 0.02 * keyframe);
      worst_db = std::max(worst_db, std::abs(db(power) - db(should_be)));
    }
    // A cached visibility is valid within a cell of 0.1 to 0.4 m, or a quarter of that at an edge.
    EXPECT_LT(worst_db, 1) << speed_mps << " m/s";
    EXPECT_GT(db(most) - db(least), 5);  // the wall casts a shadow
  }
}

TEST(RenderedOcclusion, IsConstantFromTheFirstKeyframeForAListenerAtRest) {
  const World world(hall_with_wall(), 300);
  const Vec3 behind(13.5, 1.5, 6.5);  // where the edge of the wall cuts many zones
  for (const std::size_t voices : {100, 300, 10'000}) {
    OccludedListener listener(world, world.sources, voices, true);
    const double first = listener.power_at(behind, 0);
    EXPECT_GT(first, 0);
    for (int keyframe = 1; keyframe < 100; ++keyframe)
      ASSERT_EQ(listener.power_at(behind, 0.02 * keyframe), first)
          << voices << " voices, keyframe " << keyframe;
  }
}

}  // namespace
}  // namespace clamor
