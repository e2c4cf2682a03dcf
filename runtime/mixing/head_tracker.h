// head_tracker.h: keeps the keyframes and orientations that the mixer needs to follow the head
// between keyframes.
//
// Threads: the audio thread's, except for the constructor.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "runtime/mixing/head_rotation.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

class HeadTracker {
 public:
  // `rotation` must outlive this; null: the head is not followed between keyframes.
  HeadTracker(const HeadRotation* rotation, std::size_t slots);

  bool is_on() const noexcept REALTIME { return rotation_ != nullptr; }

  // The listener's newest axes.
  void turn_head(const ListenerAxes& axes) noexcept REALTIME { newest_ = axes; }

  // Copies the keyframe, because its place in the queue will be reused.
  void keep(const Keyframe& keyframe) noexcept REALTIME;
  std::span<const Voice> voices() const noexcept REALTIME { return current_.voices; }

  // Returns whether the newest axes differ from the applied ones and there are keyframes to
  // interpolate.
  bool has_turned() const noexcept REALTIME {
    return is_on() && newest_.is_known && newest_ != applied_ && !current_.voices.empty() &&
           !previous_.voices.empty();
  }

  // The rotations of both keyframes' voices to the newest axes.
  struct Turns {
    HeadRotation::Turn current, previous;
    bool any;  // otherwise voices stay as they are
  };
  Turns turns() const noexcept REALTIME;
  void applied(const Turns& turns) noexcept REALTIME {
    applied_ = turns.any ? newest_ : current_.axes;
  }

  // A voice of the current keyframe in the segment from `elapsed` to `end` frames of the period: as
  // it is at the segment's end, for the newest axes.
  Voice interpolated(const Voice& voice, const Turns& turns, int elapsed,
                     int end) const noexcept REALTIME;

 private:
  struct Kept {
    std::vector<Voice> voices;
    ListenerAxes axes;
  };

  const HeadRotation* const rotation_;
  ListenerAxes newest_, applied_;           // applied: those at the end of the segment
  Kept previous_, current_;                 // the keyframes around the segment
  std::vector<std::uint32_t> previous_at_;  // by slot: index into previous_.voices
};

}  // namespace clamor
