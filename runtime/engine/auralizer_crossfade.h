// auralizer_crossfade.h: plays an auralizer and hands over to another one in a linear crossfade,
// during which both are mixed.
//
// Each output sample lies between those of the two, so a limiter's ceiling holds throughout.
//
// Threads: mix() on the audio thread; fade_to() and has_faded() on one other.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/engine/auralizer.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class AuralizerCrossfade {
 public:
  explicit AuralizerCrossfade(Auralizer& first);

  std::size_t channels() const noexcept REALTIME { return channels_; }

  // Crossfades to `next`, which must have as many channels and its first keyframes, from the frame
  // `from_frame` of all that was mixed on, or from the next block on if that has passed. Both are
  // mixed until has_faded(), so keyframes must be made for both. Fades must not overlap.
  void fade_to(Auralizer& next, std::uint64_t from_frame = 0);
  bool has_faded() const { return next_.load(std::memory_order_acquire) == nullptr; }

  // Overwrites `interleaved`, any number of frames of all channels.
  void mix(std::span<float> interleaved) noexcept REALTIME;

 private:
  Auralizer* playing_;  // used by the audio thread
  const std::size_t channels_;
  std::atomic<Auralizer*> next_{nullptr};  // target of a fade
  std::uint64_t fade_from_frame_ = 0;      // written before next_
  std::uint64_t frames_ = 0;               // mixed so far, by the audio thread
  std::uint64_t faded_frames_ = 0;
  std::vector<float> faded_in_;  // part of a block of the target
};

}  // namespace clamor
