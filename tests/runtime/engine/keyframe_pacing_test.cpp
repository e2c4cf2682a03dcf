#include "runtime/engine/keyframe_pacing.h"

#include <cstddef>
#include <cstdint>
#include <span>

#include <gtest/gtest.h>

#include "runtime/voices/keyframe.h"

namespace clamor {
namespace {

constexpr std::size_t kPacedVoices = 1000, kLeastSpacing = 4, kMostSpacing = 16;

AuralizerOptions paced_options() {
  AuralizerOptions options;
  options.adapt = true;
  return options;
}

// A field's sampler, which is told how long its keyframes took.
struct PacedSampler {
  MixMode mode{};
  BlockMixer mixer{
      std::span<const PreparedSignal>(), 1, mode, nullptr, nullptr, nullptr, BlockOptions{}};
  KeyframePacing pacing{paced_options(), kPacedVoices, {kLeastSpacing, kMostSpacing}, 0};
  std::uint64_t number = 0;

  // A sample whose keyframes each have `share` of their period of it, in which the field has work
  // for `field` of a period in the first one.
  void sample(double share, double field) {
    for (std::size_t k = 0; k < kLeastSpacing; ++k) {
      const WorkTime part_s = WorkTime(share * kKeyframe_s) +
                              pacing.mean_s(WorkTime((k == 0 ? field : 0) * kKeyframe_s));
      pacing.made(number++, part_s, part_s, mixer);
      share *= pacing.kept();
    }
  }
};

TEST(KeyframePacing, AnswersASampleOnceAndNotInEachKeyframeThatItServes) {
  PacedSampler sampler;
  sampler.sample(1.3, 0);
  EXPECT_EQ(sampler.pacing.load().voices(), kPacedVoices);
  EXPECT_EQ(sampler.pacing.load().spacing(), 7u);  // 4 x 1.3 / 0.75
}

TEST(KeyframePacing, AnswersABurstOfAFieldsWorkOnce) {
  PacedSampler sampler;
  sampler.sample(0.4, 5.6);
  EXPECT_EQ(sampler.pacing.load().voices(), kPacedVoices);
  EXPECT_EQ(sampler.pacing.load().spacing(), 6u);  // 4 x (0.4 + 5.6 / 8) / 0.75
}

TEST(KeyframePacing, AnswersTheNextSampleAnew) {
  PacedSampler sampler;
  for (int i = 0; i < 8; ++i) sampler.sample(1.3, 0);
  EXPECT_LT(sampler.pacing.load().voices(), kPacedVoices / 2);
  EXPECT_EQ(sampler.pacing.load().spacing(), kMostSpacing);
}

}  // namespace
}  // namespace clamor
