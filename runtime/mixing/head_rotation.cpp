#include "runtime/mixing/head_rotation.h"

namespace clamor {

ListenerAxes listener_axes(const Listener& listener) {
  return {Vec3f(listener.forward()), Vec3f(-listener.right()), Vec3f(listener.up()), true};
}

HeadRotation::Turn::Turn(const HeadRotation& turns, const ListenerAxes& from,
                         const ListenerAxes& to) noexcept
    : turns_(turns), none_(!from.is_known || !to.is_known || from == to) {
  const Vec3f axes[] = {to.ahead, to.left, to.up};
  for (int i = 0; i < 3; ++i)
    rows_[i] = {dot(axes[i], from.ahead), dot(axes[i], from.left), dot(axes[i], from.up)};
}

void HeadRotation::Turn::apply(Voice& voice) const noexcept {
  if (none_) return;
  const Vec3f before = voice.from;
  voice.from =
      normalize(Vec3f(dot(rows_[0], before), dot(rows_[1], before), dot(rows_[2], before)));
  const double later = right_ear_frames(voice.from) - right_ear_frames(before);
  for (auto* const delays : {&voice.start_delay_frames, &voice.delay_frames}) {
    (*delays)[0] -= later;
    (*delays)[1] += later;
  }
}

// Delay at the right ear relative to the centre of the head.
double HeadRotation::Turn::right_ear_frames(const Vec3f& from) const noexcept {
  if (turns_.itd_table_ != nullptr) return 0.5 * static_cast<double>((*turns_.itd_table_)(from));
  return turns_.receiver_frames_ * static_cast<double>(from.y);
}

}  // namespace clamor
