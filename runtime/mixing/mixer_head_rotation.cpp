// mixer_head_rotation.cpp: how the mixer follows head rotation between two keyframes.
//
// A period lasts from one keyframe to the next and is normally one segment. When the head has
// turned, the segment ends at the next third of the period. The next segment leads to the voices'
// interpolated state a third of a period later, as heard with the current orientation. A steady
// rotation is thus heard as steady, a third of a period late.
#include <algorithm>
#include <cassert>

#include "runtime/mixing/mixer.h"

namespace clamor {

namespace {

constexpr double kWholeFrame = 4294967296.0;  // 32.32 positions
constexpr int kThird_frames = MixerTimeline::kThird_frames;

}  // namespace

bool Mixer::follow_head() noexcept REALTIME {
  const int at = time_.elapsed + time_.frame;
  if (!tracker_.is_on() || time_.holding || at == kKeyframeFrames) return false;
  const bool ends = time_.is_at_end();
  const bool cuts = at > 0 && at % kThird_frames == 0 && has_turned();
  if (!ends && !cuts) return false;
  if (!ends) end_segment_here();
  load_segment(tracker_.voices(), at, cuts ? kThird_frames : kKeyframeFrames - at);
  return true;
}

bool Mixer::rotate_while_holding() noexcept REALTIME {
  assert(wants_keyframe());
  if (!has_turned()) return false;
  if (time_.holding) end_hold();
  load_segment(tracker_.voices(), kKeyframeFrames - kThird_frames, kThird_frames);
  return true;
}

// Ends the segment at the current gains and delays.
void Mixer::end_segment_here() noexcept REALTIME {
  const float here = static_cast<float>(time_.frame) / kGainFrames;
  const int to_knot = std::max(0, time_.segment.knot - time_.frame);
  const int after_knot = time_.segment.frames - time_.frame - to_knot;
  for (const std::uint32_t s : active_) {
    change_gains(s, [here](float* target, const float* gain, std::size_t lanes) noexcept REALTIME {
      for (std::size_t lane = 0; lane < lanes; ++lane)
        target[lane] = gain[lane] + here * gain[lanes + lane];
    });
    Slot& slot = slots_[s];
    for (std::size_t e = 0; e < static_cast<std::size_t>(mode_.delays); ++e) {
      VoicePath path = paths_[s * kEars + e];
      slot.slopes[e].end = 1 - static_cast<double>(path.step) / kWholeFrame;
      path.position = 0;
      std::int64_t advance = path.position_at(to_knot);
      if (to_knot > 0) {
        path.step = slot.after_knot[e].step;
        path.bend = slot.after_knot[e].bend;
      }
      advance += path.position_at(after_knot);
      slot.delay[e] += (advance - (std::int64_t{to_knot + after_knot} << 32)) >> (32 - kDelayBits);
    }
    if (binaural_ != nullptr) binaural_->offset_ends[s] = binaural_->offsets[s].ahead;
  }
}

}  // namespace clamor
