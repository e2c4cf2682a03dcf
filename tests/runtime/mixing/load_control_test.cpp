#include "runtime/mixing/load_control.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/player/render.h"
#include "tests/baked_room.h"
#include "tools/analysis/click_detector.h"

namespace clamor {
namespace {

constexpr double kBlock_s = 256.0 / kSampleRate_hz;

// A machine that spends a given share of a block's time on each voice and mixes as many voices as
// allowed.
struct Machine {
  MixerLoadControl load{};
  double share_per_voice = 0;
  std::size_t voices = 2000;  // in each keyframe
  int late_blocks = 0;

  double mix_block() {
    load.expect(voices);
    const std::size_t mixed = std::min(voices, load.allowed());
    const double share = share_per_voice * static_cast<double>(mixed);
    late_blocks += share > 1;
    load.mixed(share * kBlock_s, kBlock_s, mixed);
    return share;
  }
};

TEST(MixerLoadControl, IsUnlimitedWhileThereIsTime) {
  Machine machine{.share_per_voice = 0.8 / 2000};
  for (int block = 0; block < 1000; ++block) machine.mix_block();
  EXPECT_EQ(machine.load.allowed(), MixerLoadControl::kUnlimited);
}

TEST(MixerLoadControl, LetsNoBlockBeLateWhileTheCostGrows) {
  Machine machine{.share_per_voice = 0.3 / 2000};
  // The cost of a voice grows by 2 % per block, eightfold in the end.
  for (int block = 0; block < 105; ++block) {
    machine.mix_block();
    machine.share_per_voice *= 1.02;
  }
  EXPECT_EQ(machine.late_blocks, 0);
  EXPECT_NEAR(machine.mix_block(), kAimShare, kHighShare - kAimShare);
}

TEST(MixerLoadControl, LetsNoBlockBeLateWhenTooManyVoicesAreAdded) {
  Machine machine{.share_per_voice = 0.5 / 2000};
  for (int block = 0; block < 200; ++block) machine.mix_block();
  machine.voices = 20'000;
  for (int block = 0; block < 200; ++block) machine.mix_block();
  EXPECT_EQ(machine.late_blocks, 0);
  EXPECT_NEAR(machine.mix_block(), kAimShare, 0.01);
}

TEST(MixerLoadControl, LetsOneBlockBeLateWhenTheCostRisesByHalf) {
  Machine machine{.share_per_voice = 0.8 / 2000};
  for (int block = 0; block < 200; ++block) machine.mix_block();
  machine.share_per_voice *= 1.5;
  for (int block = 0; block < 2000; ++block) machine.mix_block();
  EXPECT_EQ(machine.late_blocks, 1);
  EXPECT_NEAR(static_cast<double>(machine.load.allowed()), 2000 * kAimShare / 1.2, 1);
}

TEST(MixerLoadControl, IgnoresASingleSlowBlockThatWasInTime) {
  Machine machine{.share_per_voice = 0.6 / 2000};
  for (int block = 0; block < 500; ++block) {
    machine.share_per_voice = (block % 10 == 9 ? 0.97 : 0.6) / 2000;
    machine.mix_block();
    ASSERT_EQ(machine.load.allowed(), MixerLoadControl::kUnlimited) << block;
  }
  // Two slow blocks in succession lower the limit before a block is late.
  machine.share_per_voice = 0.97 / 2000;
  for (int block = 0; block < 100; ++block) machine.mix_block();
  EXPECT_LT(machine.load.allowed(), 2000u);
  EXPECT_EQ(machine.late_blocks, 0);
}

TEST(MixerLoadControl, DoublesTheLimitInHalfTheUsualTimeWhenMuchTimeIsLeft) {
  Machine machine{.share_per_voice = 1.6 / 2000};
  machine.mix_block();
  const double least = static_cast<double>(machine.load.allowed());
  machine.share_per_voice = 0.2 / 2000;  // enough time left to double the rate
  double seconds = 0;
  for (; seconds < Backoff::kMinWait_s - kBlock_s; seconds += kBlock_s) machine.mix_block();
  EXPECT_EQ(static_cast<double>(machine.load.allowed()), least)
      << "the limit must wait before it rises";
  for (; seconds < Backoff::kMinWait_s + MixerLoadControl::kDouble_s / 2; seconds += kBlock_s)
    machine.mix_block();
  // Whole blocks are counted: up to one more at either end of the rise, 1.06 % each.
  const double two_blocks = std::exp2(2 * 2 * kBlock_s / MixerLoadControl::kDouble_s);
  EXPECT_GE(static_cast<double>(machine.load.allowed()), 2 * least / two_blocks);
  EXPECT_LE(static_cast<double>(machine.load.allowed()), 2 * least * two_blocks);
  for (; seconds < Backoff::kMinWait_s + 3 * MixerLoadControl::kDouble_s; seconds += kBlock_s)
    machine.mix_block();
  EXPECT_EQ(machine.load.allowed(), MixerLoadControl::kUnlimited);
}

TEST(MixerLoadControl, DoesNotAttributeTheFixedCostOfABlockToItsVoices) {
  MixerLoadControl load{};
  // There are ten voices, and filters take a fifth of the time.
  for (int block = 0; block < 100; ++block) load.mixed(0.2 * kBlock_s, kBlock_s, 10);
  load.expect(2000);
  EXPECT_EQ(load.allowed(), MixerLoadControl::kUnlimited);
}

TEST(SamplerLoadControl, FallsOnceToWhatFitsAndStays) {
  SamplerLoadControl limit(2000);
  for (int keyframe = 0; keyframe < 1000; ++keyframe)
    limit.keyframe_took(1.2 * static_cast<double>(limit.voices()) / 2000, 0, false);
  // The limit falls once, to the target share.
  EXPECT_EQ(limit.voices(), static_cast<std::size_t>(2000 * kAimShare / 1.2));
  EXPECT_EQ(limit.late(), 1u);
}

TEST(SamplerLoadControl, IgnoresASingleSlowKeyframeThatWasInTime) {
  SamplerLoadControl limit(2000);
  for (int keyframe = 0; keyframe < 100; ++keyframe)
    limit.keyframe_took(keyframe % 2 == 0 ? 0.99 : 0.89, 0, false);
  EXPECT_EQ(limit.voices(), 2000u);
  limit.keyframe_took(0.95, 0, false);
  EXPECT_EQ(limit.voices(), 2000u);
  limit.keyframe_took(0.95, 0, false);
  EXPECT_LT(limit.voices(), 2000u) << "two running";
  EXPECT_EQ(limit.late(), 0u);
}

TEST(SamplerLoadControl, RecoversWithinTwoSecondsAfterALateKeyframe) {
  SamplerLoadControl limit(2000);
  limit.keyframe_took(30, 0, false);
  EXPECT_EQ(limit.voices(), 1000u);  // one measurement removes at most half
  int keyframes = 0;
  while (limit.voices() < 2000 && keyframes < 100) {
    const std::size_t before = limit.voices();
    limit.keyframe_took(0.2, 0, false);
    EXPECT_LE(static_cast<double>(limit.voices() - before), 0.021 * static_cast<double>(before));
    ++keyframes;
  }
  EXPECT_LT(keyframes, 100);
  EXPECT_EQ(limit.min_so_far(), 1000u);
}

TEST(SamplerLoadControl, FollowsTheMixerDownAndThenWaits) {
  SamplerLoadControl limit(2000);
  for (int keyframe = 0; keyframe < 10; ++keyframe) limit.keyframe_took(0.1, 0.25, true);
  EXPECT_EQ(limit.voices(), 1500u);
  for (int keyframe = 0; keyframe < 100; ++keyframe) limit.keyframe_took(0.1, 0, true);
  EXPECT_EQ(limit.voices(), 1500u) << "although the mixer has more time again";
}

TEST(SamplerLoadControl, HasALowerBound) {
  SamplerLoadControl limit(2000);
  for (int keyframe = 0; keyframe < 100; ++keyframe) limit.keyframe_took(50, 0, false);
  EXPECT_EQ(limit.voices(), 2000u / SamplerLoadControl::kFloor);
}

}  // namespace
}  // namespace clamor
