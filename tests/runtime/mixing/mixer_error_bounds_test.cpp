// mixer_error_bounds_test.cpp: verifies the error bounds that mixer.h and mix_kernel.h document.
#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "runtime/mixing/keyframe_maker.h"
#include "runtime/mixing/mixer.h"
#include "tests/rooms.h"
#include "tests/runtime/hrtf_mixing.h"
#include "tests/runtime/mixer_voices.h"

namespace clamor {
namespace {

using testing::voice;

// Renders `keyframes` keyframes, starting with number `first`; next(k) returns keyframe k. Returns
// the frames of the last one.
template <class Next>
std::vector<float> rendered(Mixer& mixer, std::int64_t first, std::int64_t keyframes, Next next) {
  mixer.begin(next(first), first * kKeyframeFrames);
  std::vector<float> out(kEars * kKeyframeFrames);
  for (std::int64_t k = first + 1; k <= first + keyframes; ++k) {
    mixer.load(next(k));
    for (std::size_t at = 0; at < out.size();) {
      const int steps = mixer.steps_left();
      mixer.mix(out.data() + at, steps);
      at += static_cast<std::size_t>(kEars * steps * kStepFrames);
    }
  }
  return out;
}

// A voice moves to and fro at a delay of a large, fractional number of frames. The last 20 ms after
// an hour of mixing, at the end of a day, equal those of a mixer that started just before: delays
// are rounded to 2^-32 frames at keyframes and positions follow from the clock, so no error
// accumulates. An error of a millionth of a frame per keyframe would add up to 0.2 frames in that
// hour.
TEST(MixerErrorBounds, AreZeroForDriftAtTheEndOfADay_NoAsan) {
  const MixMode mode{Interpolation::kLinear, 1, false};
  const auto signals = prepare_signals(std::vector<Signal>{testing::sine(997)}, mode);
  Keyframe keyframe;
  keyframe.voices = {voice(0, 0, 0.7f)};
  std::vector<double> delays;  // a day is a multiple of this period
  for (int k = 0; k < 5000; ++k)
    delays.push_back(104729.1 + 500 * std::sin(std::numbers::pi * k / 2500));
  const auto walking = [&](std::int64_t k) -> const Keyframe& {
    Voice& v = keyframe.voices[0];
    v.starts = false;
    v.delay_frames.fill(delays[static_cast<std::size_t>(k) % delays.size()]);
    return keyframe;
  };
  constexpr std::int64_t kHour = 3600 * 50, kDay = 24 * kHour;  // in keyframes
  constexpr std::int64_t kFirst = kDay - kHour;
  Mixer whole(signals, 1, mode), late(signals, 1, mode);
  const auto heard = rendered(whole, kFirst, kDay - kFirst, walking);
  EXPECT_EQ(heard, rendered(late, kDay - 5, 5, walking));
  EXPECT_EQ(whole.clock_frames(), kDay * kKeyframeFrames);
  // A mixer in the first minutes of the day gives the same samples.
  Mixer first(signals, 1, mode);
  EXPECT_EQ(heard, rendered(first, 2 * 5000 - 50, 50, walking));
}

// Steps at keyframes in the worst case: gains change from full scale to its negative, and delays
// reverse at half the speed of sound.
TEST(MixerErrorBounds, HoldForGainsAndDelaysAtKeyframes_NoAsan) {
  // A constant signal shows the gains; a ramp, interpolated linearly, shows the read position.
  std::vector<Signal> sounds(2);
  sounds[0].samples = {1};
  for (int i = 0; i < 40000; ++i) sounds[1].samples.push_back(static_cast<float>(i) / 32768);
  sounds[1].loop = false;
  const MixMode mode{Interpolation::kLinear, 2, false};
  const auto signals = prepare_signals(sounds, mode);
  for (const std::uint32_t sound : {0u, 1u}) {
    const auto keyframe = [&](int k) {
      Keyframe result;
      result.voices = {voice(0, sound == 1 ? 200 * std::sin(0.9 * k) : 0,
                             sound == 0 && k % 2 == 1 ? -1.0f : 1.0f)};
      result.voices[0].starts = k == 0;
      result.voices[0].signal = sound;
      return result;
    };
    Mixer mixer(signals, 1, mode);
    mixer.begin(keyframe(0), 2000);
    std::vector<double> left;
    std::vector<float> block(kEars * kStepFrames);
    for (int k = 0; left.size() < 14 * kKeyframeFrames;) {
      if (mixer.wants_keyframe()) mixer.load(keyframe(++k));
      mixer.step(block.data());
      for (std::size_t i = 0; i < block.size(); i += kEars)
        left.push_back(static_cast<double>(block[i]) * (sound == 0 ? 1 : 32768));
    }
    for (std::size_t n = 3 * kKeyframeFrames; n + kKeyframeFrames < left.size();
         n += kKeyframeFrames) {
      // Deviation from the line through the two frames before.
      const double jump = left[n] - (2 * left[n - 1] - left[n - 2]);
      if (sound == 0) {
        EXPECT_NEAR(left[n], left[n] > 0 ? 1 : -1, 1e-6);
        EXPECT_NEAR(left[n - 1] + (left[n - 1] - left[n - 2]), left[n], 1e-6);
        EXPECT_LT(std::abs(left[n] - left[n - 1]), 2.0 / kKeyframeFrames + 2e-6);
        // The slope changes by its maximum, -1 to 1 and back: 4 / 960, a kink without a step.
        EXPECT_LT(std::abs(jump), 4.0 / kKeyframeFrames + 2e-6);
      } else {
        // Rounding of the ramp is 24 bits of 16 384.
        EXPECT_LT(std::abs(left[n] - left[n - 1] - 1), 0.99 + 4e-3);
        EXPECT_LT(std::abs(jump), 0.05 + 8e-3);
      }
    }
  }
}

// Read position of each frame, from a triangle wave that linear interpolation reproduces exactly.
// All modes interpolate delays alike.
template <class Delay>
std::vector<double> places_read(int keyframes, Delay delay_at) {
  constexpr int kRise = 4, kPeriod = 2 * kRise;
  Signal sound;
  for (int i = 0; i < kPeriod; ++i)
    sound.samples.push_back(static_cast<float>(kRise - std::abs(kRise - i)) / kRise);
  const MixMode mode{Interpolation::kLinear, 2, false};
  const auto signals = prepare_signals(std::vector<Signal>{sound}, mode);
  Mixer mixer(signals, 1, mode);
  const auto heard = testing::heard_of(mixer, keyframes * kKeyframeFrames, [&](int k) {
    Keyframe keyframe;
    keyframe.voices = {voice(0, delay_at(k), 1)};
    keyframe.voices[0].starts = k == 0;
    return keyframe;
  })[0];
  std::vector<double> places;
  for (const float sample : heard) {
    const std::size_t n = places.size();
    const double guess = n == 0   ? -delay_at(0)
                         : n == 1 ? places[0] + 1
                                  : 2 * places[n - 1] - places[n - 2];
    const double height = kRise * static_cast<double>(sample);
    const double rising = kPeriod * std::round((guess - height) / kPeriod) + height;
    const double falling = kPeriod * std::round((guess + height) / kPeriod) - height;
    places.push_back(std::abs(rising - guess) < std::abs(falling - guess) ? rising : falling);
  }
  return places;
}

TEST(MixerErrorBounds, HoldForReadPositionsAndSpeeds_NoAsan) {
  constexpr int kKeyframes = 60, kSteps = kKeyframeFrames / kStepFrames;
  const auto delay_at = [](int k) { return 600 + 200 * std::sin(0.9 * k); };
  const std::vector<double> places = places_read(kKeyframes, delay_at);
  std::vector<double> speeds;  // of each step; a step has constant speed
  for (std::size_t n = 0; n + kStepFrames < places.size(); n += kStepFrames)
    speeds.push_back((places[n + kStepFrames - 1] - places[n]) / (kStepFrames - 1));
  for (int k = 3; k + 1 < kKeyframes; ++k) {
    const auto n = static_cast<std::size_t>(k * kKeyframeFrames);
    EXPECT_NEAR(places[n], static_cast<double>(n) - delay_at(k), 2e-6) << k;
    const auto step = static_cast<std::size_t>(k * kSteps);
    EXPECT_NEAR(places[n - 1] + speeds[step - 1], places[n], 2e-6) << k;
    double bends = 0;
    for (std::size_t s = step - kSteps; s + 1 < step + kSteps; ++s)
      if (s + 1 != step) bends = std::max(bends, std::abs(speeds[s + 1] - speeds[s]));
    EXPECT_LE(std::abs(speeds[step] - speeds[step - 1]), bends + 1e-7) << k;
  }
}

// A voice of full scale fades in and out like KeyframeMaker's, with a quarter sine, in the mode
// used for playback: eight bands, cubic. Its gain is the envelope of a tone at 8 kHz, where the
// band filters are short; it appears kLate_frames later.
TEST(MixerErrorBounds, HoldForFadesInEightBands_NoAsan) {
  constexpr int kKeyframes = 24;
  constexpr double kTone_hz = 8000, kLate_frames = 10.12;
  constexpr std::size_t kWindow_frames = 12;  // two periods
  const auto fade = [](int k) {
    const int step = k < 10 ? k - 2 : 20 - k;
    return std::sin(std::numbers::pi / 2 * std::clamp(step, 0, kFadeKeyframes) / kFadeKeyframes);
  };
  const auto signals = prepare_signals(std::vector<Signal>{testing::sine(kTone_hz)});
  Mixer mixer(signals, 1);
  const auto heard = testing::heard_of(mixer, kKeyframes * kKeyframeFrames, [&](int k) {
    Keyframe keyframe;
    keyframe.voices = {voice(0, 600, static_cast<float>(fade(k)))};
    keyframe.voices[0].starts = k == 0;
    return keyframe;
  })[0];
  std::vector<double> gains;
  for (std::size_t n = 0; n + kWindow_frames <= heard.size(); n += kWindow_frames) {
    std::complex<double> sum = 0;
    for (std::size_t f = n; f < n + kWindow_frames; ++f)
      sum += static_cast<double>(heard[f]) *
             std::polar(1.0,
                        -2 * std::numbers::pi * kTone_hz / kSampleRate_hz * static_cast<double>(f));
    gains.push_back(std::abs(sum) * 2 / (0.5 * kWindow_frames));
  }
  // Line fitted to the gains between two keyframes, without the ends of that segment.
  struct Line {
    double mean_at, mean, slope;
    double at(double place) const { return mean + slope * (place - mean_at); }
  };
  const auto line = [&](double segment_begin) {
    const auto first = static_cast<std::size_t>((segment_begin + 120) / kWindow_frames);
    const std::size_t count = (kKeyframeFrames - 240) / kWindow_frames;
    Line fit{(static_cast<double>(first) + 0.5 * static_cast<double>(count)) * kWindow_frames - 0.5,
             0, 0};
    double squares = 0;
    for (std::size_t w = first; w < first + count; ++w) {
      const double x = (static_cast<double>(w) + 0.5) * kWindow_frames - 0.5 - fit.mean_at;
      fit.mean += gains[w] / static_cast<double>(count);
      fit.slope += x * gains[w];
      squares += x * x;
    }
    fit.slope /= squares;
    return fit;
  };
  double max_turn = 0;
  for (int k = 1; k + 1 < kKeyframes; ++k) {
    const double place = k * kKeyframeFrames + mixer.lead_frames() + kLate_frames;
    const Line before = line(place - kKeyframeFrames), after = line(place);
    // 1e-6 plus the residual of the filters
    EXPECT_NEAR(before.at(place), after.at(place), 2e-6) << k;
    EXPECT_NEAR(after.at(place), fade(k), 1e-5) << k;
    max_turn = std::max(max_turn, kKeyframeFrames * std::abs(after.slope - before.slope));
  }
  EXPECT_LE(max_turn, 0.31);
  EXPECT_GT(max_turn, 0.3);
  // At the frequency w, a step has the spectrum height / w and a change of slope, slope / w^2.
  const double w_per_frame = 2 * std::numbers::pi * 1000 / kSampleRate_hz;
  EXPECT_LE(20 * std::log10(max_turn / kKeyframeFrames / w_per_frame), -52);
}

// Each value of a voice is made invalid in turn, in each mode: the other voices sound as if that
// voice were absent, and the mixer counts it.
TEST(MixerErrorBounds, ContainInvalidValuesWithinTheirVoice) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  const double endless = std::numeric_limits<double>::infinity();
  MixMode panned;
  panned.pairs = 3;
  panned.delays = 1;
  const auto panner = make_loudspeaker_panner(*find_layout("5.1"));
  for (const MixMode& mode :
       {MixMode{Interpolation::kLinear, 1, false}, MixMode{}, panned, testing::kBinaural}) {
    const bool directed = mode.head || mode.pairs > 1;
    const auto signals = prepare_signals(std::vector<Signal>{testing::sine(440)}, mode);
    const auto mixed = [&](auto&& spoil, std::uint64_t& bad) {
      Mixer mixer(signals, 3, mode, mode.pairs > 1 ? panner.get() : nullptr,
                  mode.head ? &testing::kemar_head() : nullptr);
      std::vector<float> out, block(static_cast<std::size_t>(mixer.channels() * kStepFrames));
      for (int k = 0; k < 4; ++k) {
        Keyframe keyframe;
        keyframe.voices = {voice(0, 50, 0.5f), voice(1, 60, 0.5f)};
        for (Voice& v : keyframe.voices) v.starts = k == 0;
        spoil(keyframe.voices, k);
        if (k == 0) mixer.begin(keyframe, 0);
        if (k > 0) mixer.load(keyframe);
        while (k > 0 && !mixer.wants_keyframe()) {
          mixer.step(block.data());
          out.insert(out.end(), block.begin(), block.end());
        }
      }
      bad = mixer.bad_voices();
      return out;
    };
    std::uint64_t bad = 0;
    const auto alone = mixed([](std::vector<Voice>& voices, int) { voices.resize(1); }, bad);
    EXPECT_EQ(bad, 0u);
    const std::vector<std::function<void(Voice&)>> spoilers = {
        [&](Voice& v) { v.gain[0][0] = none; },
        [&](Voice& v) { v.gain[1][7] = none; },
        [&](Voice& v) { v.gain[0][3] = std::numeric_limits<float>::infinity(); },
        [&](Voice& v) { v.gain[1][2] = 1e30f; },
        [&](Voice& v) { v.delay_frames[0] = static_cast<double>(none); },
        [&](Voice& v) { v.delay_frames[1] = endless; },
        [&](Voice& v) { v.start_delay_frames[0] = v.starts ? -endless : 0, v.gain[0][1] = none; },
        [&](Voice& v) { v.from = directed ? Vec3f(none, 0, 0) : v.from, v.gain[1][0] = none; },
    };
    for (std::size_t i = 0; i < spoilers.size(); ++i) {
      const auto out = mixed([&](std::vector<Voice>& voices, int) { spoilers[i](voices[1]); }, bad);
      EXPECT_EQ(out, alone) << i;
      EXPECT_EQ(bad, 4u) << i;
      // A voice that becomes invalid fades to silence, and nothing else changes.
      const auto ill = mixed(
          [&](std::vector<Voice>& voices, int k) {
            if (k >= 2) spoilers[i](voices[1]);
          },
          bad);
      EXPECT_EQ(bad, 2u) << i;
      EXPECT_TRUE(std::ranges::all_of(ill, [](float x) { return std::isfinite(x); })) << i;
    }
  }
}

}  // namespace
}  // namespace clamor
