#include "runtime/sampling/moving_sources.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer_input.h"
#include "runtime/probes/combined_pool.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/sampling/moving_source_list.h"
#include "runtime/sampling/sampler.h"
#include "tests/baked_room.h"
#include "tests/runtime/moving_field.h"
#include "tests/runtime/priority_estimates.h"
#include "tests/runtime/priority_sample_reference.h"

namespace clamor {
namespace {

using testing::place_in_room;

// A baked room with two kinds of moving sources.
struct Stage {
  static constexpr std::size_t kKinds = 2;

  explicit Stage(std::size_t most)
      : input(with_kinds()),
        radiation(input.emitters, input.materials, input.air),
        moving(most, kKinds),
        list(moving, radiation, by_signal(), input.emitters, kKinds) {}

  static AuralizerInput with_kinds() {
    AuralizerInput input = testing::baked_room(400);
    MovingOptions options;
    options.kinds = {{"car", 0, {}}, {"horn", 1, same_in_all_bands(3)}};
    EXPECT_TRUE(add_kinds(options, input).ok());
    return input;
  }
  const SignalWeights& by_signal() {
    weights.by_signal.assign(input.signals.size(), {1, 2, 3, 4, 5, 4, 3, 2});
    return weights;
  }
  MovingHandle add(std::uint32_t i, double gain = 1) {
    MovingSource source;
    source.kind = i % 2;
    source.position_m = place_in_room(i, 0);
    source.axis = {1, 0.5, -1};
    source.gain = same_in_all_bands(static_cast<float>(gain));
    auto handle = moving.add(source);
    EXPECT_TRUE(handle.ok());
    return *handle;
  }
  double weight_of(const Source& source, const Vec3& place) const {
    return weight(radiation, weights.by_signal[radiation.signal(source)], source, place);
  }
  // All moving sources as of the last commit.
  std::vector<FoundSource> all_moving(const Vec3& place, double time_s) {
    std::vector<FoundSource> found;
    list.refresh();
    list.begin({place, time_s});
    list.find_above(0, found.max_size(), found);
    return found;
  }

  SignalWeights weights;
  AuralizerInput input;
  RadiationModel radiation;
  MovingSources moving;
  MovingSourceList list;
};

TEST(MovingSources, AreSampledLikeASortOfAllSources_NoAsan_NoTsan) {
  constexpr std::size_t kVoices = 150;
  Stage stage(2000);
  SourceList still(stage.radiation, stage.weights, stage.input.sources);
  CombinedPool pool({&still, &stage.list});
  const auto sampler = make_priority_sampler(stage.radiation, stage.weights, pool, kVoices);
  std::vector<MovingHandle> handles;
  for (std::uint32_t step = 0; step < 60; ++step) {
    const Vec3 listener(1 + 0.05 * step, 2 + 0.03 * step, 1.5);
    for (std::uint32_t i = 0; i < 30; ++i) handles.push_back(stage.add(30 * step + i, 0.1));
    if (step % 3 == 0) {
      EXPECT_TRUE(stage.moving.remove(handles[7 * step]).ok());
    }
    for (std::uint32_t i = 0; i < handles.size(); i += 2)
      if (step % 3 != 0 || i != 7 * step)
        (void)stage.moving.move(handles[i], place_in_room(i, step));
    stage.moving.commit();

    std::vector<testing::WeightedSource> all;
    const auto add = [&](std::uint64_t number, const Source& source) {
      all.push_back({number, stage.weight_of(source, listener), source.u});
    };
    for (std::size_t i = 0; i < still.page().size(); ++i) add(i, still.page()[i]);
    const auto sample = sampler->sample(listener, 0.02 * step);
    ASSERT_EQ(sample.size(), kVoices);
    const auto of_moving = std::ranges::count_if(sample, [](const SampledSource& chosen) {
      return (chosen.number & kMovingSourceBit) != 0;
    });
    EXPECT_GT(of_moving, 0);
    EXPECT_LT(of_moving, static_cast<std::ptrdiff_t>(kVoices));
    const auto moving = stage.all_moving(listener, 0.02 * step);
    EXPECT_EQ(moving.size(), stage.moving.size());
    for (const FoundSource& found : moving) add(found.voice, *found.source);
    testing::expect_sample(sample, testing::reference_sample(std::move(all), kVoices), 1e-12);
    if (HasFatalFailure()) FAIL() << "step " << step;
  }
}

TEST(MovingSources, AreUnbiasedInTotalPower_NoAsan_NoTsan) {
  constexpr std::size_t kVoices = 20, kSources = 200;
  constexpr int kRolls = 1000;
  Stage stage(kSources);
  SourceList none(stage.radiation, stage.weights, {});
  CombinedPool pool({&none, &stage.list});
  const auto sampler = make_priority_sampler(stage.radiation, stage.weights, pool, kVoices);
  const Vec3 listener(4, 5, 1.6);
  std::vector<MovingHandle> handles;
  testing::PriorityEstimates estimates;
  for (int roll = 0; roll < kRolls; ++roll) {
    for (const MovingHandle handle : handles) ASSERT_TRUE(stage.moving.remove(handle).ok());
    handles.clear();
    for (std::uint32_t i = 0; i < kSources; ++i) handles.push_back(stage.add(i));
    stage.moving.commit();
    double whole = 0, estimate = 0;
    for (const SampledSource& chosen : sampler->sample(listener, roll))
      estimate += chosen.power_scale * stage.weight_of(*chosen.source, listener);
    for (const FoundSource& found : stage.all_moving(listener, roll))
      whole += stage.weight_of(*found.source, listener);
    estimates.add(estimate / whole);
  }
  estimates.expect_unbiased(kVoices);
}

TEST(MovingSources, MoveWithTheirVelocityUntilEachKeyframe_NoTsan) {
  Stage stage(1);
  MovingSource source;
  source.position_m = {10, 0, 0};
  source.velocity_mps = {30, -3, 0};
  ASSERT_TRUE(stage.moving.add(source).ok());
  stage.moving.commit(5);
  // The listener is at the source, so there is no delay.
  const auto at = [&](double time_s, const Vec3& place) {
    return stage.all_moving(place, time_s).front().source->position_m;
  };
  EXPECT_NEAR(at(5.1, {13, -0.3, 0}).x, 13, 1e-5);
  EXPECT_NEAR(at(5.2, {16, -0.6, 0}).x, 16, 1e-5);
  EXPECT_NEAR(at(5.2, {16, -0.6, 0}).y, -0.6, 1e-5);
  EXPECT_NEAR(at(4.9, {7, 0.3, 0}).x, 7, 1e-5);
  // A source that nobody has moved for so long may be anywhere: it stops.
  for (double t = 4.92; t < 9; t += kKeyframe_s) (void)at(t, {});
  EXPECT_NEAR(at(9, {}).x, 10 + 30 * kMaxExtrapolation_s, 1e-4);
}

TEST(MovingSources, ReportErrorsAndThenChangeNothing_NoTsan) {
  MovingSources moving(2, 1);
  MovingSource source;
  const auto first = moving.add(source);
  ASSERT_TRUE(first.ok() && moving.add(source).ok());
  const auto full = moving.add(source);
  ASSERT_FALSE(full.ok());
  EXPECT_NE(full.error().message.find("there are 2 moving sources already"), std::string::npos);
  EXPECT_FALSE(moving.move(*first, {NAN, 0, 0}).ok());
  EXPECT_FALSE(moving.move({}, {}).ok());
  source.kind = 1;
  EXPECT_FALSE(moving.change(*first, source).ok());
  ASSERT_TRUE(moving.remove(*first).ok());
  EXPECT_FALSE(moving.remove(*first).ok());
  source.kind = 0;
  for (const float hostile : {-0.1f, 100.1f, NAN, HUGE_VALF}) {
    source.reverberation = hostile;
    EXPECT_FALSE(moving.add(source).ok()) << hostile;
  }
  source.reverberation = 1;
  const auto again = moving.add(source);  // reuses the slot
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(moving.move(*first, {1, 2, 3}).ok()) << "a handle never names another source";
  EXPECT_TRUE(moving.move(*again, {1, 2, 3}).ok());
}

TEST(MovingSources, RefusePlacesAndSpeedsThatAreNone) {
  MovingSources moving(1, 1);
  MovingSource source;
  source.position_m = {1, 2, 3};
  const auto handle = moving.add(source);
  ASSERT_TRUE(handle.ok());
  for (const double odd : {static_cast<double>(NAN), static_cast<double>(INFINITY), 1e30, -1e300})
    for (const Vec3& place_m : {Vec3(odd, 0, 0), Vec3(0, odd, 0), Vec3(0, 0, odd)}) {
      const auto moved = moving.move(*handle, place_m);
      ASSERT_FALSE(moved.ok()) << odd;
      EXPECT_NE(moved.error().message, "");
      EXPECT_FALSE(moving.move(*handle, {}, place_m).ok()) << odd;
      MovingSource changed = source;
      changed.position_m = place_m;
      EXPECT_FALSE(moving.change(*handle, changed).ok()) << odd;
      EXPECT_FALSE(moving.add(changed).ok()) << odd;
      changed = source;
      changed.axis = place_m;
      // An axis only needs a direction.
      if (!std::isfinite(odd)) {
        EXPECT_FALSE(moving.change(*handle, changed).ok()) << odd;
      }
    }
  moving.commit();
  const MovingSources::State& now = moving.now();
  ASSERT_EQ(now.count, 1u);
  EXPECT_EQ(Vec3f(now.x_m[0], now.y_m[0], now.z_m[0]), Vec3f(1, 2, 3));
  EXPECT_EQ(Vec3f(now.x_mps[0], now.y_mps[0], now.z_mps[0]), Vec3f(0));
}

// A hundred thousand sources move in every keyframe, and the sample still equals that of a sort.
TEST(MovingSources, AreSampledLikeASortWhenAHundredThousandMove_NoAsan_NoTsan) {
  constexpr std::size_t kMany = 100'000, kVoices = 500;
  Stage stage(kMany);
  SourceList still(stage.radiation, stage.weights, stage.input.sources);
  CombinedPool pool({&still, &stage.list});
  const auto sampler = make_priority_sampler(stage.radiation, stage.weights, pool, kVoices);
  std::vector<MovingHandle> handles;
  for (std::uint32_t i = 0; i < kMany; ++i) handles.push_back(stage.add(i, 0.01));
  const Vec3 listener(3, 4, 1.5);
  for (std::uint32_t step = 0; step < 10; ++step) {
    for (std::uint32_t i = 0; i < kMany; ++i)
      ASSERT_TRUE(stage.moving.move(handles[i], place_in_room(i, step)).ok());
    stage.moving.commit();
    std::vector<std::uint64_t> sample;
    for (const SampledSource& chosen : sampler->sample(listener, 0.02 * step))
      sample.push_back(chosen.number);
    if (step % 3 != 0) continue;
    std::vector<std::pair<double, std::uint64_t>> all;
    for (std::size_t i = 0; i < still.page().size(); ++i)
      all.emplace_back(
          stage.weight_of(still.page()[i], listener) / static_cast<double>(still.page()[i].u), i);
    for (const FoundSource& found : stage.all_moving(listener, 0.02 * step))
      all.emplace_back(
          stage.weight_of(*found.source, listener) / static_cast<double>(found.source->u),
          found.voice);
    std::nth_element(all.begin(), all.begin() + kVoices, all.end(), std::greater<>());
    std::vector<std::uint64_t> expected;
    for (std::size_t i = 0; i < kVoices; ++i) expected.push_back(all[i].second);
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(sample, expected) << "step " << step;
  }
}

}  // namespace
}  // namespace clamor
