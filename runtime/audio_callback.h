// audio_callback.h: what the mixer does on the audio thread: mix a block, pass on what is recorded
// and metered, and end in silence.
//
// Threads: fill() on the audio thread; counters() on any.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>

#include "runtime/auralizer.h"
#include "runtime/realtime/realtime.h"
#include "runtime/realtime/sample_ring.h"

namespace clamor {

class AudioCallback {
 public:
  struct Counters {
    std::uint64_t frames = 0;  // mixed so far
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

  void fill(std::span<float> interleaved) noexcept REALTIME;

  Counters counters() const;

 private:
  Auralizer& auralizer_;
  SampleRing* record_;
  SampleRing* meter_;
  const std::uint64_t frames_;
  int silent_blocks_ = 0;

  std::atomic<std::uint64_t> mixed_{0};
  std::atomic<bool> finished_{false};
};

}  // namespace clamor
