// limiter.h: a look-ahead true-peak limiter.
//
// Each channel is oversampled four times with the filter of BS.1770, kLimiterDelayFrames ahead of
// the output. Before a peak would exceed the ceiling, the gain of all channels falls to the
// smallest gain that any frame ahead requires, averaged over the look-ahead window. The attack is
// therefore complete when the peak arrives, and the gain is smooth. The release is 3 dB in 100 ms.
// Below the ceiling the gain is exactly 1, and the output is the delayed input, bit for bit.
//
// ITU-R BS.1770-4, annex 2. Its filter underestimates a peak by at most 0.6 dB at a quarter of the
// sample rate, and by 0.1 dB below 10 kHz; the ceiling of -1 dBFS leaves room for that.
//
// Threads: process() on the audio thread; work() on any.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/realtime/realtime.h"

namespace clamor {

inline constexpr int kLimiterDelayFrames = 72;  // 1.5 ms
inline constexpr double kLimiterCeiling_db = -1;

class Limiter {
 public:
  explicit Limiter(std::size_t channels);

  // Processes any number of frames in place. The output is delayed by kLimiterDelayFrames.
  void process(std::span<float> interleaved) noexcept REALTIME;

  struct Work {
    std::uint64_t frames = 0;  // with gain reduction
    float min_gain = 1;        // the largest gain reduction, as a gain
  };
  Work worked() const noexcept;

 private:
  static constexpr int kPhases = 4, kTaps = 12;
  static constexpr int kWindow = kLimiterDelayFrames - kTaps / 2;  // frames known ahead

  // The true peak over all channels.
  class TruePeak {
   public:
    explicit TruePeak(std::size_t channels) : channels_(channels), newest_(channels * 2 * kTaps) {}

    // Takes the next frame. Returns the peak kTaps / 2 frames before.
    float after(const float* frame) noexcept REALTIME;

   private:
    const std::size_t channels_;
    // The newest samples of each channel, stored twice so that a window never wraps.
    std::vector<float> newest_;
    std::size_t at_ = 0;
  };

  // The gain that holds the peaks of the look-ahead window below the ceiling.
  class GainReduction {
   public:
    GainReduction();

    // Takes the next peak. Returns the gain of the frame that is output.
    float after(float peak) noexcept REALTIME;

   private:
    std::array<float, kWindow> required_;  // by the frames ahead, a ring buffer
    std::array<float, kWindow> held_;      // their minimum after the release
    std::size_t at_ = 0;
    int busy_frames_ = 0;  // until every gain in both is 1 again
    float released_ = 1;
    double sum_ = kWindow;  // of held_
  };

  const std::size_t channels_;
  std::vector<float> delayed_;  // a ring buffer of frames
  std::size_t at_ = 0;          // the next of them to be output
  TruePeak peak_;
  GainReduction gain_;

  std::atomic<std::uint64_t> limited_{0};
  std::atomic<float> min_gain_{1};
};

}  // namespace clamor
