// audio_callback.h: the player's work on the audio thread: mixes blocks, passes them on to the
// recording and the loudness meter, and ends in silence.
//
// Threads: fill() on the audio thread; fade_to() and has_faded() on one other; counters() on any.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>

#include "runtime/engine/auralizer_crossfade.h"
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

  std::size_t channels() const noexcept REALTIME { return playing_.channels(); }

  // The same functions as those of AuralizerCrossfade.
  void fade_to(Auralizer& next, std::uint64_t from_frame = 0) {
    playing_.fade_to(next, from_frame);
  }
  bool has_faded() const { return playing_.has_faded(); }

  void fill(std::span<float> interleaved) noexcept REALTIME;

  Counters counters() const;

 private:
  AuralizerCrossfade playing_;  // mixed by the audio thread
  SampleRing* record_;
  SampleRing* meter_;
  const std::uint64_t frames_;
  int silent_blocks_ = 0;

  std::atomic<std::uint64_t> mixed_{0};
  std::atomic<bool> finished_{false};
};

}  // namespace clamor
