#include "runtime/mixing/head_tracker.h"

namespace clamor {

namespace {

// With more voices than these, rotations come with keyframes only: reloading all voices would fill
// a short block.
constexpr std::size_t kMaxTurning = 5000;

}  // namespace

HeadTracker::HeadTracker(const HeadRotation* rotation, std::size_t slots) : rotation_(rotation) {
  if (rotation == nullptr) return;
  for (Kept* const kept : {&previous_, &current_}) {
    // Touches the memory, since the audio thread must not fault.
    kept->voices.resize(std::min(slots, kMaxTurning));
    kept->voices.clear();
  }
  previous_at_.resize(slots);
}

void HeadTracker::keep(const Keyframe& keyframe) noexcept REALTIME {
  std::swap(previous_, current_);
  current_.voices.clear();
  current_.axes = keyframe.facing;
  if (keyframe.voices.size() > current_.voices.capacity()) {
    previous_.voices.clear();
    return;
  }
  current_.voices.assign(keyframe.voices.begin(), keyframe.voices.end());
  for (std::uint32_t v = 0; v < previous_.voices.size(); ++v)
    previous_at_[previous_.voices[v].slot] = v;
}

HeadTracker::Turns HeadTracker::turns() const noexcept REALTIME {
  static constexpr HeadRotation kNone(nullptr, 0);
  const bool any = is_on() && newest_.is_known;
  const HeadRotation& rotation = any ? *rotation_ : kNone;
  return {HeadRotation::Turn(rotation, current_.axes, newest_),
          HeadRotation::Turn(rotation, previous_.axes, newest_), any};
}

Voice HeadTracker::interpolated(const Voice& voice, const Turns& turns, int elapsed,
                                int end) const noexcept REALTIME {
  Voice now = voice;
  turns.current.apply(now);
  if (elapsed > 0) now.starts = false;
  if (end == kKeyframeFrames) return now;
  const double along = static_cast<double>(end) / kKeyframeFrames;
  const auto share = static_cast<float>(along);
  const std::uint32_t at = previous_at_[voice.slot];
  const bool was_there =
      !voice.starts && at < previous_.voices.size() && previous_.voices[at].slot == voice.slot;
  Voice before = was_there ? previous_.voices[at] : now;
  if (was_there) {
    turns.previous.apply(before);
  } else {
    if (!voice.has_onset) before.gain = {};  // a sound that begins is not faded in
    if (voice.starts) before.delay_frames = now.start_delay_frames;
  }
  for (std::size_t e = 0; e < kEars; ++e) {
    now.delay_frames[e] =
        before.delay_frames[e] + along * (now.delay_frames[e] - before.delay_frames[e]);
    for (std::size_t b = 0; b < kBandCount; ++b)
      now.gain[e][b] = before.gain[e][b] + share * (now.gain[e][b] - before.gain[e][b]);
  }
  const Vec3f between = before.from + share * (now.from - before.from);
  if (dot(between, between) > 0.01f) now.from = normalize(between);
  return now;
}

}  // namespace clamor
