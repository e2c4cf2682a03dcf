// audio_callback.h: the player's work on the audio thread: mixes blocks, passes them on to the
// recording and the loudness meter, and ends in silence.
//
// fade_to() hands over to another auralizer in a linear crossfade, during which both are mixed.
// Each output sample lies between those of the two, so a limiter's ceiling holds throughout.
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
    bool finished = false;     // all frames and two blocks of silence have been output
  };

  // `frames` is the length before silence, 0 for no end. The output is also written to `record` and
  // `meter`, which may be null.
  AudioCallback(Auralizer& auralizer, SampleRing* record, std::uint64_t frames,
                SampleRing* meter = nullptr);

  std::size_t channels() const noexcept REALTIME { return channels_; }

  // Crossfades from the next block on to `next`, which must have as many channels and its first
  // keyframes. Both are mixed until has_faded(), so keyframes must be made for both. Fades must not
  // overlap.
  void fade_to(Auralizer& next);
  bool has_faded() const { return next_.load(std::memory_order_acquire) == nullptr; }

  void fill(std::span<float> interleaved) noexcept REALTIME;

  Counters counters() const;

 private:
  void mix(std::span<float> interleaved) noexcept REALTIME;

  Auralizer* playing_;  // used by the audio thread
  const std::size_t channels_;
  std::atomic<Auralizer*> next_{nullptr};  // target of a fade
  std::uint64_t faded_frames_ = 0;
  std::vector<float> faded_in_;  // part of a block of the target
  SampleRing* record_;
  SampleRing* meter_;
  const std::uint64_t frames_;
  int silent_blocks_ = 0;

  std::atomic<std::uint64_t> mixed_{0};
  std::atomic<bool> finished_{false};
};

}  // namespace clamor
