#include "runtime/mixer.h"

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/rooms.h"

namespace clamor {
namespace {

Voice voice(std::uint32_t slot, double delay_frames, float gain) {
  Voice v;
  v.slot = slot;
  v.starts = true;
  v.start_delay_frames = v.delay_frames = {delay_frames, delay_frames};
  v.gain = {same_in_all_bands(gain), same_in_all_bands(gain)};
  return v;
}

// The left ear of so many steps, keyframe k being next(k).
template <class Next>
std::vector<float> mixed(const std::vector<PreparedSignal>& signals, int steps, Next next,
                         std::int64_t clock = 0, std::uint64_t* bad = nullptr) {
  Mixer mixer(signals, 8);
  std::uint64_t number = 0;
  mixer.begin(next(number++), clock);
  std::vector<float> out, block(2 * kStepFrames);
  for (int s = 0; s < steps; ++s) {
    if (mixer.wants_keyframe()) mixer.load(next(number++));
    mixer.step(block.data());
    for (int f = 0; f < kStepFrames; ++f) out.push_back(block[static_cast<std::size_t>(2 * f)]);
  }
  if (bad != nullptr) *bad = mixer.bad_voices();
  return out;
}

TEST(Mixer, HoldsPhaseForADay) {
  const auto signals = prepare_signals(std::vector<Signal>{testing::sine(997)});
  const auto still = [](std::uint64_t number) {
    Keyframe keyframe;
    keyframe.voices = {voice(0, 1234.56789, 0.7f)};
    keyframe.voices[0].starts = number == 0;
    return keyframe;
  };
  const std::int64_t day = std::int64_t{24} * 3600 * kSampleRate_hz;  // a whole number of loops
  EXPECT_EQ(mixed(signals, 200, still), mixed(signals, 200, still, day));
}

TEST(Mixer, ShiftsThePitchOfAPassingSourceAsDopplerSays) {
  const auto signals = prepare_signals(std::vector<Signal>{testing::sine(1000)});
  constexpr double kSpeed_mps = 30, kNearest_m = 20, kSound_mps = 343.2;
  const auto delay_s = [](double t) {
    return std::hypot(kNearest_m, kSpeed_mps * (t - 1)) / kSound_mps;
  };
  // Within a keyframe the pitch is that of the chord: nearer passes change it faster than 50 times
  // a second.
  const auto passing = [&](std::uint64_t number) {
    Keyframe keyframe;
    const double t = static_cast<double>(number) * kKeyframeFrames / kSampleRate_hz;
    keyframe.voices = {voice(0, delay_s(t) * kSampleRate_hz, 0.5f)};
    keyframe.voices[0].starts = number == 0;
    return keyframe;
  };
  const auto out = mixed(signals, 2 * kSampleRate_hz / kStepFrames, passing);
  // Phase at the middle of each keyframe, by demodulation over half of it.
  constexpr double kOmega = 2 * std::numbers::pi * 1000;
  const auto phase_at = [&](int frame) {
    std::complex<double> sum = 0;
    for (int n = frame - 240; n < frame + 240; ++n)
      sum += static_cast<double>(out[static_cast<std::size_t>(n)]) *
             std::polar(1.0, -kOmega * n / kSampleRate_hz);
    return std::arg(sum);
  };
  for (int k = 2; k < 97; ++k) {
    const int from = k * kKeyframeFrames + 480, to = from + kKeyframeFrames;
    const auto seconds = [](int frame) { return static_cast<double>(frame) / kSampleRate_hz; };
    const double expected = -kOmega * (delay_s(seconds(to)) - delay_s(seconds(from)));
    const double turned = phase_at(to) - phase_at(from);
    const double wrong_hz =
        std::remainder(turned - expected, 2 * std::numbers::pi) / (2 * std::numbers::pi * 0.02);
    EXPECT_NEAR(wrong_hz, 0, 1) << "keyframe " << k;  // 0.1 % of 1 kHz
  }
}

TEST(Mixer, ReadsAtFractionsOfAFrameAsCatmullRomDoes) {
  Signal signal = testing::sine(440);
  const auto signals = prepare_signals(std::vector<Signal>{signal});
  const auto still = [](std::uint64_t number) {
    Keyframe keyframe;
    keyframe.voices = {voice(0, 100.25, 1)};
    keyframe.voices[0].starts = number == 0;
    return keyframe;
  };
  const auto out = mixed(signals, 100, still);
  const auto length = static_cast<std::int64_t>(signal.samples.size());
  for (std::int64_t n = 0; n < 6400; ++n) {
    const std::int64_t i = n - 101;  // n - 100.25 = i + 0.75
    double y[4];
    for (std::int64_t k = -1; k <= 2; ++k)
      y[k + 1] = signal.samples[static_cast<std::size_t>(((i + k) % length + length) % length)];
    const double t = 0.75;
    const double expected =
        0.5 * (2 * y[1] + (y[2] - y[0]) * t + (2 * y[0] - 5 * y[1] + 4 * y[2] - y[3]) * t * t +
               (3 * y[1] - 3 * y[2] + y[3] - y[0]) * t * t * t);
    ASSERT_NEAR(out[static_cast<std::size_t>(n)], expected, 1e-5) << n;  // -100 dB of full scale
  }
}

TEST(Mixer, SilencesAVoiceWhoseNumbersAreNoneAndNoOther) {
  const auto signals = prepare_signals(std::vector<Signal>{testing::sine(440)});
  const auto frames = [](bool with_bad) {
    return [with_bad](std::uint64_t number) {
      Keyframe keyframe;
      keyframe.voices = {voice(0, 50, 0.5f)};
      if (with_bad) {
        keyframe.voices.push_back(voice(1, 50, std::numeric_limits<float>::quiet_NaN()));
        keyframe.voices.push_back(voice(2, std::numeric_limits<double>::infinity(), 0.5f));
      }
      for (Voice& v : keyframe.voices) v.starts = number == 0;
      return keyframe;
    };
  };
  std::uint64_t bad = 0;
  const auto clean = mixed(signals, 60, frames(false));
  EXPECT_EQ(clean, mixed(signals, 60, frames(true), 0, &bad));
  EXPECT_GE(bad, 2u);
}

TEST(Mixer, PlaysAOneShotOnceAtItsTime) {
  const auto signals = prepare_signals(std::vector<Signal>{{"click", {1, 0.5f}, false}});
  const auto still = [](std::uint64_t number) {
    Keyframe keyframe;
    keyframe.voices = {voice(0, 2000, 1)};
    keyframe.voices[0].starts = number == 0;
    return keyframe;
  };
  const auto out = mixed(signals, 200, still);
  for (std::size_t n = 0; n < out.size(); ++n)
    ASSERT_NEAR(out[n], n == 2000 ? 1 : n == 2001 ? 0.5 : 0, 1e-4) << n;
}

}  // namespace
}  // namespace clamor
