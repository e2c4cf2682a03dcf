#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/mixing/mixer.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

Voice panned_voice(std::uint32_t slot, const Vec3f& from, float gain, bool starts) {
  Voice voice;
  voice.slot = slot;
  voice.starts = starts;
  voice.from = from;
  voice.start_delay_frames = voice.delay_frames = {100.25, 100.25};
  voice.gain = {same_in_all_bands(gain), same_in_all_bands(gain)};
  return voice;
}

MixMode panned_mode(const Panner& panner) {
  MixMode mode;
  mode.delays = 1;
  mode.pairs = panner.channels() / kEars;
  return mode;
}

// Interleaved frames of `keyframes` keyframes; next(k) returns keyframe k.
template <class Next>
std::vector<float> panned(const Panner& panner, const std::vector<Signal>& sounds, int keyframes,
                          Next next) {
  const MixMode mode = panned_mode(panner);
  const auto signals = prepare_signals(sounds, mode);
  Mixer mixer(signals, 8, mode, &panner);
  mixer.begin(next(0), 0);
  const auto channels = static_cast<std::size_t>(mixer.channels());
  std::vector<float> out(channels * static_cast<std::size_t>(keyframes * kKeyframeFrames));
  int number = 1;
  for (std::size_t at = 0; at < out.size(); at += channels * kStepFrames) {
    if (mixer.wants_keyframe()) mixer.load(next(number++));
    mixer.step(out.data() + at);
  }
  return out;
}

// Each channel equals the stereo mix times the panner's gain, for one voice that moves and one that
// does not.
TEST(MixerPanning, GivesEachChannelTheStereoMixTimesTheGainOfThePanner) {
  const std::vector<Signal> sounds = {testing::sine(700)};
  const auto going = [](int k) {
    const float turn = 0.4f * static_cast<float>(k);
    return Vec3f(std::cos(turn), std::sin(turn), 0.3f) / std::sqrt(1.09f);
  };
  const std::unique_ptr<Panner> panners[] = {make_loudspeaker_panner(*find_layout("5.1")),
                                             make_loudspeaker_panner(*find_layout("7.1.4")),
                                             make_ambisonic_panner()};
  for (const auto& panner : panners) {
    const Vec3f still = {0, -1, 0};
    const auto out = panned(*panner, sounds, 4, [&](int k) {
      Keyframe keyframe;
      keyframe.voices = {panned_voice(0, going(k), 0.4f, k == 0),
                         panned_voice(3, still, 0.2f, k == 0)};
      return keyframe;
    });
    const MixMode stereo{Interpolation::kCubic, 1, true};
    const auto signals = prepare_signals(sounds, stereo);
    const auto channels = static_cast<std::size_t>(panner->channels());
    for (std::size_t c = 0; c < channels; ++c) {
      Mixer alone(signals, 8, stereo);
      const auto keyframe = [&](int k) {
        Keyframe result;
        result.voices = {panned_voice(0, going(k), 0.4f * panner->gains(going(k))[c], k == 0),
                         panned_voice(3, still, 0.2f * panner->gains(still)[c], k == 0)};
        return result;
      };
      alone.begin(keyframe(0), 0);
      std::vector<float> block(kEars * kStepFrames);
      int number = 1;
      for (std::size_t f = 0; f < out.size() / channels; f += kStepFrames) {
        if (alone.wants_keyframe()) alone.load(keyframe(number++));
        alone.step(block.data());
        for (std::size_t i = 0; i < kStepFrames; ++i)
          ASSERT_NEAR(out[(f + i) * channels + c], block[kEars * i], 2e-6) << c << ' ' << f + i;
      }
    }
  }
}

TEST(MixerPanning, SilencesAVoiceWhoseDirectionIsNotANumber) {
  const auto panner = make_ambisonic_panner();
  const auto out = panned(*panner, {testing::sine(700)}, 2, [&](int k) {
    Keyframe keyframe;
    keyframe.voices = {panned_voice(0, {std::nanf(""), 0, 0}, 1, k == 0)};
    return keyframe;
  });
  for (const float sample : out) ASSERT_EQ(sample, 0);
}

TEST(MixerPanning, ResumesAVoiceWhoseDirectionBecomesValidAgain) {
  const auto panner = make_ambisonic_panner();
  const auto out = panned(*panner, {testing::sine(700)}, 4, [&](int k) {
    Keyframe keyframe;
    const float x = k == 1 ? std::nanf("") : 1;
    keyframe.voices = {panned_voice(0, {x, 0, 0}, 1, k == 0)};
    return keyframe;
  });
  float loudest = 0;
  for (const float sample : out) {
    ASSERT_TRUE(std::isfinite(sample));
    loudest = std::max(loudest, std::abs(sample));
  }
  const std::vector<float> last(out.end() - 1000, out.end());
  EXPECT_GT(*std::max_element(last.begin(), last.end()), 0.5f * loudest);
}

}  // namespace
}  // namespace clamor
