#include "runtime/mixing/head_rotation.h"

#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "common/listener.h"
#include "runtime/mixing/mixer.h"
#include "runtime/voices/octave_filter_bank.h"

namespace clamor {
namespace {

// While the head turns, the mixer reaches its first keyframe in three parts.
TEST(MixerHeadRotation, DoesNotFadeInASoundThatStarts) {
  constexpr MixMode kFullBand{.eight_bands = false};
  const auto signals = prepare_signals(
      std::vector<Signal>{{"flat", std::vector<float>(4800, 1.0f), true}}, kFullBand);
  const HeadRotation turns(nullptr, 0);
  Mixer mixer(signals, 2, kFullBand, nullptr, nullptr, &turns);
  Keyframe keyframe;
  keyframe.facing = listener_axes({});
  keyframe.voices.resize(1);  // a silent voice
  mixer.begin(keyframe, 0);
  double yaw_rad = 0;
  std::vector<float> period;
  for (int k = 0; k < 4; ++k) {
    if (k == 3) {
      Voice& begins = keyframe.voices.emplace_back();
      begins.slot = 1;
      begins.starts = begins.has_onset = true;
      begins.gain = {same_in_all_bands(1), same_in_all_bands(1)};
    }
    period.clear();
    std::array<float, kEars * kMaxFrames> out;
    for (bool loaded = false; !loaded || !mixer.wants_keyframe(); loaded = true) {
      yaw_rad += 0.01;
      mixer.turn_head(listener_axes(Listener({}, yaw_rad, 0)));
      if (loaded)
        mixer.follow_head();
      else
        mixer.load(keyframe);
      const int steps = mixer.steps_left();
      mixer.mix(out.data(), steps);
      period.insert(period.end(), out.begin(), out.begin() + kEars * kStepFrames * steps);
    }
  }
  ASSERT_EQ(period.size(), std::size_t{kEars} * kKeyframeFrames);
  EXPECT_GT(mixer.work().loaded_voices, 1u + 1u + 3u + 3u * 2u);  // in parts
  for (const float sample : period) ASSERT_NEAR(sample, 1, 1e-5);
}

}  // namespace
}  // namespace clamor
