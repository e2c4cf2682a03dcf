// limiter.h: keeps the true peaks of the output below full scale, and off the path until it must.
//
// Sound between the samples counts too: each channel is looked at four times as finely, through the
// filter of BS.1770 for that, kLimiterDelayFrames ahead of what goes out. Where a peak would pass
// the ceiling, the gain of all channels falls to it beforehand, by the smallest gain that any frame
// ahead asks for, averaged over the time that it is known ahead: so it is there when the peak is,
// and never turns a corner. It comes back by 3 dB in 100 ms. Below the ceiling the gain is 1, and
// what goes out is what came in, bit by bit, only that much later.
//
// ITU-R BS.1770-4, annex 2. Its filter misses at most 0.6 dB of a peak at a quarter of the rate,
// 0.1 dB below 10 kHz; the ceiling, -1 dBFS, leaves room for that.
//
// Threads: process() on the audio thread; worked() on any.
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

  // In place, any number of frames: what comes out is what went in kLimiterDelayFrames ago.
  void process(std::span<float> interleaved) noexcept REALTIME;

  struct Work {
    std::uint64_t frames = 0;  // that went out with less than their own gain
    float min_gain = 1;        // of them all
  };
  Work worked() const noexcept;

 private:
  static constexpr int kPhases = 4, kTaps = 12;
  static constexpr int kWindow = kLimiterDelayFrames - kTaps / 2;  // frames known ahead

  float peak_ahead() const noexcept REALTIME;

  const std::size_t channels_;
  std::vector<float> ring_;  // frames on their way out
  std::size_t at_ = 0;       // the frame of the ring that goes out next
  // Newest samples of each channel, twice over so that a window never wraps.
  std::vector<float> newest_;
  std::size_t newest_at_ = 0;

  std::array<float, kWindow> wanted_;  // gains that frames ahead ask for, by turns
  std::array<float, kWindow> held_;    // the least of those, released slowly
  std::size_t window_at_ = 0;
  int busy_frames_ = 0;  // until every gain in both is 1 again
  float released_ = 1;
  double sum_ = kWindow;  // of held_

  std::atomic<std::uint64_t> limited_{0};
  std::atomic<float> least_{1};
};

}  // namespace clamor
