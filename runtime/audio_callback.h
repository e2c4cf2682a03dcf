// audio_callback.h: all that happens on the audio thread: mix a block, end in time, keep count.
//
// A callback is late when it takes longer than the block it fills, when it begins later than the
// device's buffers last, or when the device says that it ran dry.
//
// Threads: fill() on the audio thread; counters() on any.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <span>

#include "runtime/auralizer.h"
#include "runtime/realtime.h"
#include "runtime/sample_ring.h"

namespace clamor {

class AudioCallback {
 public:
  struct Counters {
    std::uint64_t callbacks = 0, late = 0;
    std::uint64_t frames = 0;  // mixed so far
    double cpu_share = 0;      // of the block's time, smoothed over a second or so
    bool finished = false;     // all frames and two blocks of silence have been given out
  };

  // `frames`: how many to mix before silence, 0 for no end. What is played also goes to `record`
  // and to `meter`, which may be null.
  AudioCallback(Auralizer& auralizer, SampleRing* record, std::uint64_t frames,
                SampleRing* meter = nullptr)
      : auralizer_(auralizer), record_(record), meter_(meter), frames_(frames) {}

  std::size_t channels() const noexcept REALTIME {
    return static_cast<std::size_t>(auralizer_.channels());
  }

  void fill(std::span<float> interleaved, bool underflow) noexcept REALTIME;

  Counters counters() const;

 private:
  using Clock = std::chrono::steady_clock;

  Auralizer& auralizer_;
  SampleRing* record_;
  SampleRing* meter_;
  const std::uint64_t frames_;
  Clock::time_point last_start_{};
  int silent_blocks_ = 0;

  std::atomic<std::uint64_t> callbacks_{0}, late_{0}, mixed_{0};
  std::atomic<double> cpu_share_{0};
  std::atomic<bool> finished_{false};
};

}  // namespace clamor
