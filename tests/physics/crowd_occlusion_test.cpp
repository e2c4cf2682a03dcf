// crowd_occlusion_test.cpp: a crowd whose members share estimates of their occlusion sounds like
// one in which each has an estimate of its own, in an offline render as in real time.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "formats/gltf/level_import.h"
#include "formats/level/walk_file.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/query/source_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/build_paths.h"
#include "tests/runtime/two_rooms.h"

namespace clamor {
namespace {

using testing::heard;
using testing::World;

using Power = std::array<double, kBandCount>;

constexpr std::size_t kVoices = 2000;
constexpr double kKeyframe_s = 0.02;
const std::string kLevels = std::string(testing::kSourceDir) + "/assets/levels/";

// A sampler of a world's sources with a visibility cache.
class Hearing {
 public:
  Hearing(const World& world, bool exact)
      : pool_(world.radiation, world.weights, world.sources),
        occlusion_(world.surfaces, testing::kSpeed_mps, VisibilityOptions{.exact = exact}),
        sampler_(make_priority_sampler(world.radiation, world.weights, pool_, kVoices, &occlusion_,
                                       exact ? SearchBound::kUnbounded : SearchBound::kBounded)) {}

  std::span<const SampledSource> sample(const Vec3& place) {
    Listener listener;
    listener.position_m = place;
    return sampler_->sample(listener);
  }
  std::uint64_t fine_estimates() const { return occlusion_.statistics().fine_estimates; }

 private:
  SourceList pool_;
  VisibilityCache occlusion_;
  std::unique_ptr<Sampler> sampler_;
};

// The power of a sample whose sources each have an estimate of their own, made at this place.
Power expected_power(const World& world, std::span<const SampledSource> sample, const Vec3& place) {
  VisibilityCache cache(world.surfaces, testing::kSpeed_mps, VisibilityOptions{.exact = true});
  cache.begin_keyframe(place);
  Power power{};
  for (const SampledSource& one : sample) {
    const Source& source = world.sources[one.number];
    const Bands visibility = cache.estimate_now(one.number, source);
    const Bands intensity = world.radiation.intensity(source, place);
    for (std::size_t b = 0; b < kBandCount; ++b)
      power[b] += one.power_scale * static_cast<double>(intensity[b] * visibility[b]);
  }
  return power;
}

void add(const Power& power, Power& sum) {
  std::ranges::transform(power, sum, sum.begin(), std::plus());
}

void expect_near_db(const Power& power, const Power& expected, double most_db) {
  for (std::size_t b = 0; b < kBandCount; ++b)
    EXPECT_NEAR(10 * std::log10(power[b] / expected[b]), 0, most_db) << "band " << b;
}

class CrowdOcclusion : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const auto level = import_level(kLevels + "stadium.glb", {});
    ASSERT_TRUE(level.ok()) << level.error().message;
    world_ = new World(level->level, 2000);
    walk_ = new Result<Walk>(Walk::read(kLevels + "stadium_walk.json"));
    ASSERT_TRUE(walk_->ok()) << walk_->error().message;
  }
  static void TearDownTestSuite() {
    delete world_;
    delete walk_;
  }
  static Vec3 place_at(double time_s) { return (*walk_)->at(time_s).position_m; }

  static World* world_;
  static Result<Walk>* walk_;
};
World* CrowdOcclusion::world_ = nullptr;
Result<Walk>* CrowdOcclusion::walk_ = nullptr;

// The listener walks up the stairs, and among fans on the walkway, for as long as it takes a budget
// of rays to settle after the jump to the beginning. Both runs take the same path, so their
// estimates may differ only by when the budget of rays allowed them: by up to 0.3 dB in a keyframe,
// but not in the 400 ms that momentary loudness is the mean of.
TEST_F(CrowdOcclusion, OfAStadiumIsTheSameOfflineAndLiveAndWithAnEstimateForEachFan) {
  constexpr int kKeyframes = 160, kHeard = 20;
  for (const double start_s : {40.0, 57.0}) {
    SCOPED_TRACE(::testing::Message() << "from " << start_s << " s");
    Hearing offline(*world_, true), live(*world_, false);
    Power offline_sum{}, live_sum{};
    for (int i = 0; i < kKeyframes; ++i) {
      const Vec3 place = place_at(start_s + i * kKeyframe_s);
      const auto sample = offline.sample(place), live_sample = live.sample(place);
      if (i < kKeyframes - kHeard) continue;
      const Power power = heard(*world_, sample, place);
      add(power, offline_sum);
      add(heard(*world_, live_sample, place), live_sum);
      if (i < kKeyframes - 1) continue;
      // Two estimates for some ten fans each are off by a tenth of a decibel, and so are those that
      // are valid for another half metre.
      expect_near_db(power, expected_power(*world_, sample, place), 0.25);
    }
    expect_near_db(live_sum, offline_sum, 0.2);
    // With an estimate for each there were ten times as many.
    EXPECT_LT(offline.fine_estimates(), 2 * kVoices);
  }
}

// Without the wall they would be far louder than the whole crowd, and behind it they are about as
// loud. What a source may add to the sum decides about its precision, not what is left of it.
TEST(CrowdOcclusionByAWall, IsRightForTenLoudSourcesAmongAllOthers) {
  constexpr std::size_t kLoud = 10, kSpacing = 1000;  // in the list of emitters
  auto level = import_level(kLevels + "stadium.glb", {});
  ASSERT_TRUE(level.ok()) << level.error().message;
  testing::add_quad(level->level.mesh, {{{-6, 0, 4}, {6, 0, 4}, {6, 4, 4}, {-6, 4, 4}}});
  for (std::size_t i = 0; i < kLoud; ++i) {
    const auto n = static_cast<double>(i);
    Emitter& emitter = level->level.emitters[kSpacing * i];
    emitter.position_m = {1.1 * n - 5, 1.5, 6 + 0.3 * std::fmod(n, 3)};
    emitter.axis = {0, 0, -1};
    emitter.gain = 40;
  }
  const World world(level->level, 200);
  Hearing offline(world, true);
  std::span<const SampledSource> sample;
  Vec3 place{};
  for (int i = 0; i <= 50; ++i) {
    place = {-1 + 0.028 * i, 1.7, 0};
    sample = offline.sample(place);
  }
  std::vector<SampledSource> loud;
  for (const SampledSource& one : sample)
    if (world.sources[one.number].is_emitter && world.sources[one.number].emitter % kSpacing == 0 &&
        world.sources[one.number].emitter < kSpacing * kLoud)
      loud.push_back(one);
  ASSERT_EQ(loud.size(), kLoud);
  expect_near_db(heard(world, loud, place), expected_power(world, loud, place), 1);
  expect_near_db(heard(world, sample, place), expected_power(world, sample, place), 1);
}

}  // namespace
}  // namespace clamor
