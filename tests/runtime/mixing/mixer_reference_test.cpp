// mixer_reference_test.cpp: the mixer against a reference mix in double precision.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/mixing/mixer.h"
#include "tests/runtime/mixer_voices.h"

namespace clamor {
namespace {

using testing::voice;

// Reference mix in double precision, from the original samples and by closed forms.
class ReferenceMix {
 public:
  ReferenceMix(const std::vector<Signal>& signals, Interpolation interpolation)
      : signals_(signals), cubic_(interpolation == Interpolation::kCubic) {}

  double read(std::uint32_t signal, double frame) const {
    const double whole = std::floor(frame), f = frame - whole, g = 1 - f;
    const auto k = static_cast<std::int64_t>(whole);
    const Signal& s = signals_[signal];
    if (!cubic_) return g * sample(s, k) + f * sample(s, k + 1);
    return (g * g * g * knot(s, k - 1) + (4 - 6 * f * f + 3 * f * f * f) * knot(s, k) +
            (4 - 6 * g * g + 3 * g * g * g) * knot(s, k + 1) + f * f * f * knot(s, k + 2)) /
           6;
  }

 private:
  static double sample(const Signal& s, std::int64_t k) {
    const auto size = static_cast<std::int64_t>(s.samples.size());
    if (s.loop) k = (k % size + size) % size;
    return k < 0 || k >= size ? 0 : static_cast<double>(s.samples[static_cast<std::size_t>(k)]);
  }

  // Spline coefficient: sqrt(3) (sqrt(3) - 2)^|m| is the inverse of (1/6, 4/6, 1/6).
  static double knot(const Signal& s, std::int64_t k) {
    double sum = 0;
    for (std::int64_t m = -24; m <= 24; ++m)
      sum += std::sqrt(3.0) * std::pow(std::sqrt(3.0) - 2, static_cast<double>(std::abs(m))) *
             sample(s, k - m);
    return sum;
  }

  const std::vector<Signal>& signals_;
  const bool cubic_;
};

// Change of a delay `f` frames after keyframe k - 1. Each step has the slope of its middle, on two
// lines through the slopes at steps 0, 8 and 15.
double delay_change_frames(const std::vector<Keyframe>& keyframes, std::size_t k, std::uint32_t v,
                           int ear, int f) {
  const auto mean = [&](std::size_t at) {
    return at < 2 ? 0
                  : (keyframes[at - 1].voices[v].delay_frames[ear] -
                     keyframes[at - 2].voices[v].delay_frames[ear]) /
                        kKeyframeFrames;
  };
  // slopes decided at that keyframe: constant where the delay changes too fast
  const auto end = [&](std::size_t at) {
    double last = 0, last_mean = 0;
    std::array<double, 3> slopes{};
    for (std::size_t i = 2; i <= at; ++i) {
      const double now = mean(i), c = 1.5 * now - 0.5 * last_mean;
      const double b = (30 * now - 8 * last - 7 * c) / 15;
      slopes = {last, b, c};
      if (std::max({std::abs(last), std::abs(b), std::abs(c)}) > 0.99) slopes = {now, now, now};
      last = slopes[2];
      last_mean = now;
    }
    return slopes;
  };
  const auto [a, b, c] = end(k + 1);
  double slid = 0;
  for (int step = 0; step < f / kStepFrames + 1 && step < 15; ++step) {
    const double slope =
        step < 8 ? a + (b - a) * (step + 0.5) / 8 : b + (c - b) * (step - 8 + 0.5) / 7;
    slid += slope * std::min(kStepFrames, f - step * kStepFrames);
  }
  return slid;
}

constexpr int kMixedVoices = 16, kMixedKeyframes = 5;
constexpr std::int64_t kMixedClock = 100'000;

double between(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

std::vector<Signal> loops_and_one_shots(std::mt19937& random) {
  std::vector<Signal> sounds;
  for (const bool loop : {true, false})
    for (const std::size_t length : {1u, 5u, 777u, 1500u}) {
      Signal& sound = sounds.emplace_back();
      sound.loop = loop;
      for (std::size_t i = 0; i < length; ++i)
        sound.samples.push_back(static_cast<float>(between(random, -1, 1)));
    }
  return sounds;
}

// One-shots start, play and end within these keyframes, and some delays change at nearly the speed
// of sound.
std::vector<Keyframe> random_keyframes(std::mt19937& random, std::size_t signals) {
  std::vector<Keyframe> keyframes(kMixedKeyframes);
  for (std::uint32_t v = 0; v < kMixedVoices; ++v)
    for (std::uint64_t k = 0; k < kMixedKeyframes; ++k) {
      Voice& now = keyframes[k].voices.emplace_back(voice(v, 0, 0));
      now.signal = v % static_cast<std::uint32_t>(signals);
      now.starts = k == 0;
      for (int e = 0; e < kEars; ++e) {
        const double fast = v % 4 == 0 ? 900 : v % 4 == 1 ? 100 : 2;
        now.delay_frames[e] =
            k == 0 ? kMixedClock + between(random, 0, 3000)
                   : keyframes[k - 1].voices[v].delay_frames[e] + between(random, -fast, fast);
        now.gain[e] = same_in_all_bands(static_cast<float>(between(random, -0.25, 0.25)));
      }
    }
  return keyframes;
}

std::vector<double> expected_mix(const ReferenceMix& reference,
                                 const std::vector<Keyframe>& keyframes) {
  std::vector<double> expected(2 * (kMixedKeyframes - 1) * kKeyframeFrames);
  for (std::size_t k = 1; k < kMixedKeyframes; ++k)
    for (std::uint32_t v = 0; v < kMixedVoices; ++v)
      for (int e = 0; e < kEars; ++e)
        for (int f = 0; f < kKeyframeFrames; ++f) {
          const Voice &from = keyframes[k - 1].voices[v], &to = keyframes[k].voices[v];
          const double t = static_cast<double>(f) / kKeyframeFrames;
          const double gain = (1 - t) * static_cast<double>(from.gain[e][0]) +
                              t * static_cast<double>(to.gain[e][0]);
          const double delay = from.delay_frames[e] + delay_change_frames(keyframes, k, v, e, f);
          const std::size_t frame = (k - 1) * kKeyframeFrames + static_cast<std::size_t>(f);
          expected[2 * frame + static_cast<std::size_t>(e)] +=
              gain * reference.read(from.signal, static_cast<double>(kMixedClock) +
                                                     static_cast<double>(frame) - delay);
        }
  return expected;
}

// At most `steps` steps per call.
std::vector<float> mixed_keyframes(const std::vector<PreparedSignal>& signals, const MixMode& mode,
                                   const std::vector<Keyframe>& keyframes, int steps) {
  Mixer mixer(signals, kMixedVoices, mode);
  mixer.begin(keyframes[0], kMixedClock);
  std::vector<float> out(2 * (kMixedKeyframes - 1) * kKeyframeFrames);
  std::size_t next = 1;
  for (std::size_t at = 0; at < out.size();) {
    if (mixer.wants_keyframe()) mixer.load(keyframes[next++]);
    const int now = std::min(steps, mixer.steps_left());
    mixer.mix(out.data() + at, now);
    at += static_cast<std::size_t>(2 * now * kStepFrames);
  }
  return out;
}

TEST(Mixer, EqualsTheReferenceAcrossTheEndsOfLoopsAndOneShots) {
  std::mt19937 random(2);
  const std::vector<Signal> sounds = loops_and_one_shots(random);
  const std::vector<Keyframe> keyframes = random_keyframes(random, sounds.size());
  for (const Interpolation interpolation : {Interpolation::kLinear, Interpolation::kCubic}) {
    const auto expected = expected_mix(ReferenceMix(sounds, interpolation), keyframes);
    const MixMode mode{interpolation, 2, false};
    const auto signals = prepare_signals(sounds, mode);
    for (const std::string& target : mix_kernel_targets())
      for (const int steps : {1, 4}) {
        force_mix_kernel(target);
        const auto out = mixed_keyframes(signals, mode, keyframes, steps);
        double worst = 0;
        for (std::size_t i = 0; i < out.size(); ++i)
          worst = std::max(worst, std::abs(static_cast<double>(out[i]) - expected[i]));
        EXPECT_LT(worst, 1e-5) << target << (interpolation == Interpolation::kCubic);  // -100 dB
      }
    force_mix_kernel("");
  }
}

}  // namespace
}  // namespace clamor
