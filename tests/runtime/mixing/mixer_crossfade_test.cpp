// mixer_crossfade_test.cpp: the crossfade between a source that leaves the sample and one that
// enters it.
//
// The two play square waves that are orthogonal over any four frames, even when multiplied by
// linear ramps, so both gains and the power can be measured in every four frames.
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/mixing/keyframe_maker.h"
#include "runtime/mixing/mixer.h"
#include "tests/runtime/mixer_voices.h"

namespace clamor {
namespace {

constexpr std::size_t kWindow_frames = 4;
constexpr float kWaves[2][kWindow_frames] = {{1, 1, -1, -1}, {1, -1, 1, -1}};

struct Moment {
  double leaving = 0, entering = 0;  // gains relative to those without a fade
  double power = 0;
};

// Measures every four frames; is_second(k) tells whether keyframe k contains the second source.
template <class Choice>
std::vector<Moment> faded(int keyframes, Choice is_second) {
  std::vector<Signal> sounds(2);
  for (std::size_t s = 0; s < 2; ++s) sounds[s].samples.assign(kWaves[s], kWaves[s] + 4);
  const MixMode mode{Interpolation::kLinear, 1, false};
  const auto signals = prepare_signals(sounds, mode);

  const std::vector<Emitter> emitters(1);
  const RadiationModel radiation(emitters, std::vector<Material>(1), Air{});
  // The distance is a whole number of frames, so nothing is interpolated.
  const double away_m = 96.0 / kSampleRate_hz * radiation.speed_of_sound_mps();
  Source source;
  source.is_emitter = true;
  source.power = same_in_all_bands(1);
  KeyframeMaker maker(radiation, 4, KeyframeMaker::Receivers::kOne);
  Mixer mixer(signals, 4, mode);
  const auto out = testing::heard_of(mixer, keyframes * kKeyframeFrames, [&](int k) {
    SampledSource chosen;
    chosen.number = chosen.signal = is_second(k) ? 1 : 0;
    chosen.source = &source;
    Keyframe keyframe;
    keyframe.voices.reserve(4);
    maker.make({&chosen, 1}, Listener{{0, 0, away_m}, 0, 0}, keyframe);
    return keyframe;
  })[0];

  std::vector<Moment> moments;
  for (std::size_t n = 0; n + kWindow_frames <= out.size(); n += kWindow_frames) {
    Moment& now = moments.emplace_back();
    for (std::size_t f = 0; f < kWindow_frames; ++f) {
      const double sample = out[n + f];
      now.leaving += sample * kWaves[0][f] / kWindow_frames;
      now.entering += sample * kWaves[1][f] / kWindow_frames;
      now.power += sample * sample / kWindow_frames;
    }
  }
  const double level = moments[0].leaving;
  for (Moment& now : moments)
    now = {now.leaving / level, now.entering / level, now.power / (level * level)};
  return moments;
}

// Gains are linear between keyframes, so the pair of gains moves on a chord of the unit circle. The
// chord of a twentieth of a turn lies at most 0.11 dB inside the circle.
double power_on_chord(double frames) {
  const double along = frames / kKeyframeFrames - std::floor(frames / kKeyframeFrames);
  const double half_turn = std::numbers::pi / (4 * kFadeKeyframes);
  return 1 - 4 * along * (1 - along) * std::pow(std::sin(half_turn), 2);
}

TEST(Crossfade, HasConstantPower) {
  constexpr int kLeaves = 3;  // the first keyframe with the second source
  const auto moments = faded(12, [](int k) { return k >= kLeaves; });
  const double begins = (kLeaves - 1) * kKeyframeFrames;
  for (std::size_t w = 0; w < moments.size(); ++w) {
    const double middle = static_cast<double>(w * kWindow_frames) + 1.5, since = middle - begins;
    const auto& [leaving, entering, power] = moments[w];
    const bool fades = since > 0 && since < kFadeKeyframes * kKeyframeFrames;
    const double expected = fades ? power_on_chord(since) : 1;
    // The tolerance covers rounding; also, windows extend 1.5 frames across keyframes.
    ASSERT_NEAR(power, expected, 1e-4) << middle;
    ASSERT_NEAR(leaving * leaving + entering * entering, expected, 1e-4) << middle;
    // Each gain lies between the gains at both ends of its chord.
    const double step = std::min(std::floor(std::max(since, 0.0) / kKeyframeFrames),
                                 static_cast<double>(kFadeKeyframes));
    const double turn = std::numbers::pi / (2 * kFadeKeyframes), slack = 1e-3;
    ASSERT_LE(leaving, std::cos(turn * step) + slack) << middle;
    ASSERT_GE(leaving, std::cos(turn * std::min<double>(step + 1, kFadeKeyframes)) - slack);
    ASSERT_GE(entering, std::sin(turn * step) - slack) << middle;
    ASSERT_LE(entering, std::sin(turn * std::min<double>(step + 1, kFadeKeyframes)) + slack);
  }
}

TEST(Crossfade, Takes50To200Milliseconds) {
  const auto moments = faded(12, [](int k) { return k >= 3; });
  double entering_s = 0, leaving_s = 0;
  for (const Moment& now : moments) {
    constexpr double kTakes_s = 1.0 * kWindow_frames / kSampleRate_hz;
    entering_s += now.entering > 1e-4 && now.entering < 1 - 1e-4 ? kTakes_s : 0;
    leaving_s += now.leaving > 1e-4 && now.leaving < 1 - 1e-4 ? kTakes_s : 0;
  }
  for (const double takes_s : {entering_s, leaving_s}) {
    EXPECT_GE(takes_s, 0.05);
    EXPECT_LE(takes_s, 0.2);
    EXPECT_NEAR(takes_s, 1.0 * kFadeKeyframes * kKeyframeFrames / kSampleRate_hz, 1e-3);
  }
}

// A source that returns while it fades out reverses its fade, at constant power.
TEST(Crossfade, HasConstantPowerWhenItReverses) {
  const auto moments = faded(16, [](int k) { return k >= 3 && k < 6; });
  const double least = std::pow(std::cos(std::numbers::pi / (4 * kFadeKeyframes)), 2);
  double max_entering = 0;
  for (const Moment& now : moments) {
    ASSERT_GE(now.power, least - 1e-4);
    ASSERT_LE(now.power, 1 + 1e-4);
    max_entering = std::max(max_entering, now.entering);
  }
  EXPECT_NEAR(max_entering, std::sin(std::numbers::pi / 2 * 3 / kFadeKeyframes), 1e-3);
  EXPECT_NEAR(moments.back().leaving, 1, 1e-4);
  EXPECT_NEAR(moments.back().entering, 0, 1e-6);
}

}  // namespace
}  // namespace clamor
