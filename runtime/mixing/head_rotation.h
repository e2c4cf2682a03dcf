// head_rotation.h: updates a voice for a rotation of the listener's head.
//
// A rotation needs no new sample and no rays: a voice keeps its spectrum and its path, and only its
// direction and the delays at the ears change. The audio thread therefore applies the newest
// rotation itself (mixer.h) instead of waiting for the next keyframe.
//
// With an HRTF the ITD comes from itd_table.h. Two plain receivers are treated as far from the
// source, which at 1 m is wrong by at most 0.5 frames until the next keyframe corrects it.
// Directivity patterns of receivers also follow with the next keyframe.
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
  // `itd_table` is an HRTF's table, or null; it must outlive this. `receiver_frames` is the travel
  // time of sound from the centre to either of two receivers, 0 for one receiver.
  constexpr HeadRotation(const ItdTable* itd_table, double receiver_frames)
      : itd_table_(itd_table), receiver_frames_(receiver_frames) {}

  // One rotation, from the axes that voices were made for to new ones.
  class Turn {
   public:
    Turn(const HeadRotation& turns, const ListenerAxes& from,
         const ListenerAxes& to) noexcept REALTIME;

    // Changes nothing if there is no rotation.
    void apply(Voice& voice) const noexcept REALTIME;

   private:
    double right_ear_frames(const Vec3f& from) const noexcept REALTIME;

    const HeadRotation& turns_;
    const bool none_;
    Vec3f rows_[3];  // of the rotation matrix
  };

 private:
  const ItdTable* const itd_table_;
  const double receiver_frames_;
};

}  // namespace clamor
