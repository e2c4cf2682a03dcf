// head_rotation.h: what changes about a voice when the listener's head turns and nothing else does.
//
// A turn needs no new sample of sources and no ray: a voice keeps its spectrum and its path, comes
// from another direction of the head, and reaches one ear earlier and the other one later. So the
// audio thread applies the newest turn itself (mixer.h), and does not wait for the next keyframe.
//
// With a head, the time between the ears is the head's (itd_table.h). Two receivers are taken to be
// far from the source: at 1 m that is wrong by 0.5 frames at most, until the next keyframe says it
// exactly. Patterns of receivers follow with the next keyframe, too.
//
// Threads: any.
#pragma once

#include "common/listener.h"
#include "runtime/mixing/itd_table.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

ListenerAxes listener_axes(const Listener& listener);

class HeadRotation {
 public:
  // `lags`: of a head, or null; it must outlive this. `receiver_frames`: how long sound takes from
  // the middle to either of two receivers; 0 where there is only one.
  HeadRotation(const ItdTable* lags, double receiver_frames)
      : lags_(lags), receiver_frames_(receiver_frames) {}

  // One turn, from the facing that voices were made for to another.
  class Turn {
   public:
    Turn(const HeadRotation& turns, const ListenerAxes& from,
         const ListenerAxes& to) noexcept REALTIME;

    // Leaves it alone where there is no turn.
    void apply(Voice& voice) const noexcept REALTIME;

   private:
    double right_ear_frames(const Vec3f& from) const noexcept REALTIME;

    const HeadRotation& turns_;
    const bool none_;
    Vec3f rows_[3];  // of the matrix that turns directions
  };

 private:
  const ItdTable* const lags_;
  const double receiver_frames_;
};

}  // namespace clamor
