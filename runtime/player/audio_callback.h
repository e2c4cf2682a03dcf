// audio_callback.h: what the mixer does on the audio thread: mix a block, pass on what is recorded
// and metered, and end in silence.
//
// fade_to() hands the sound over to another auralizer in a linear crossfade, during which both are
// mixed. Each output sample lies between those of the two, so a limiter's ceiling holds throughout.
//
// Threads: fill() on the audio thread; fade_to() and has_faded() on one other; counters() on any.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/engine/auralizer.h"
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
                SampleRing* meter = nullptr);

  std::size_t channels() const noexcept REALTIME { return channels_; }

  // From the next block on: `next`, which has as many channels and its first keyframes. Both are
  // mixed until has_faded(), and keyframes should be made for both; before that no other follows.
  void fade_to(Auralizer& next);
  bool has_faded() const { return next_.load(std::memory_order_acquire) == nullptr; }

  void fill(std::span<float> interleaved) noexcept REALTIME;

  Counters counters() const;

 private:
  void mix(std::span<float> interleaved) noexcept REALTIME;

  Auralizer* playing_;  // the audio thread's
  const std::size_t channels_;
  std::atomic<Auralizer*> next_{nullptr};  // to be faded to
  std::uint64_t faded_frames_ = 0;
  std::vector<float> faded_in_;  // of the next: a part of a block
  SampleRing* record_;
  SampleRing* meter_;
  const std::uint64_t frames_;
  int silent_blocks_ = 0;

  std::atomic<std::uint64_t> mixed_{0};
  std::atomic<bool> finished_{false};
};

}  // namespace clamor
