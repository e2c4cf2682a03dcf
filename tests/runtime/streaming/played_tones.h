// played_tones.h: long sounds with a closed form, and a mixer that plays them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "runtime/mixing/mixer.h"
#include "runtime/streaming/sound_loader.h"

namespace clamor::testing {

inline constexpr std::uint64_t kSecond_frames = kSampleRate_hz;

// Full band and without layers, so the output is gain times signal and invalid memory shows.
inline constexpr MixMode kPlain{.eight_bands = false};

// Slowly modulated tones that never repeat.
inline float sample_at(std::size_t signal, std::uint64_t frame) {
  const auto t = static_cast<double>(frame) / kSampleRate_hz;
  return static_cast<float>(0.4 * std::sin(2 * std::numbers::pi * (110 + 7 * double(signal)) * t) *
                            (1.2 + std::sin(0.7 * t)));
}

inline Signal sound(std::size_t number, const SignalDescription& shape) {
  Signal signal{"sound", {}, shape.loop};
  for (std::uint64_t i = 0; i < shape.frames; ++i) signal.samples.push_back(sample_at(number, i));
  return signal;
}

inline SignalBlockCache::Decode decoder(const std::vector<SignalDescription>& shapes) {
  return [shapes](std::size_t signal, std::size_t block) -> Result<std::vector<float>> {
    const SignalBlock where = signal_block(shapes[signal].frames, block);
    std::vector<float> samples;
    for (std::uint64_t i = 0; i < where.frames; ++i)
      samples.push_back(sample_at(signal, where.first + i));
    return samples;
  };
}

inline Voice tone_voice(std::uint32_t slot, std::uint32_t signal, double delay_s, float gain = 1) {
  Voice one;
  one.slot = slot;
  one.signal = signal;
  one.delay_frames.fill(delay_s * kSampleRate_hz);
  for (Bands& ear : one.gain) ear.fill(gain);
  return one;
}

// A mixer with constant keyframes, with or without a loader.
class Playing {
 public:
  Playing(std::span<const PreparedSignal> signals, std::vector<Voice> voices, const MixMode& mode,
          SoundLoader* loader = nullptr)
      : loader_(loader), mixer_(signals, voices.size(), mode) {
    keyframe_.voices = std::move(voices);
    begin();
  }

  // Left ear of the next segment, from a new keyframe or with the last one held.
  std::vector<float> segment(bool keyframe = true, bool wait = true) {
    std::vector<float> both(2 * kKeyframeFrames), left;
    if (keyframe && loader_ != nullptr) loader_->play(keyframe_.voices);
    for (int done = 0; done < kKeyframeFrames;) {
      if (mixer_.wants_keyframe()) {
        if (loader_ != nullptr) pass(wait);
        keyframe ? mixer_.load(keyframe_) : mixer_.hold();
      }
      const int steps = mixer_.steps_left();
      mixer_.mix(both.data() + 2 * done, steps);
      done += steps * kStepFrames;
    }
    for (std::size_t i = 0; i < both.size(); i += 2) left.push_back(both[i]);
    return left;
  }

  Mixer& mixer() { return mixer_; }

 private:
  void begin() {
    if (loader_ != nullptr) {
      loader_->play(keyframe_.voices);
      pass(true);
    }
    mixer_.begin(keyframe_, 0);
  }

  // Memory is freed only by a pass, and requests that wait for it are served after the next.
  void pass(bool wait) {
    loader_->mark_quiescent(mixer_.clock_frames());
    for (int i = 0; wait && i < 2000 && !loader_->wait(0.005); ++i)
      loader_->mark_quiescent(mixer_.clock_frames());
  }

  SoundLoader* const loader_;
  Keyframe keyframe_;
  Mixer mixer_;
};

// Largest second difference per frame squared.
inline float bend(const std::vector<float>& curve) {
  float most = 0;
  for (std::size_t i = 2; i < curve.size(); ++i)
    most = std::max(most, std::abs(curve[i] - 2 * curve[i - 1] + curve[i - 2]));
  return most;
}
// Bound of the second difference of the tones above and of a gain ramp that starts at 0 and reaches
// twice their amplitude within 960 frames.
inline constexpr float kMaxBend = 0.88f * (2.0e-4f + 2.5f / kKeyframeFrames);

}  // namespace clamor::testing
