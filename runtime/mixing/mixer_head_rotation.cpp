// mixer_head_rotation.cpp: how the mixer follows a head that turns between two keyframes.
//
// From one keyframe to the next is a period. Without turns it is one segment. When the head has
// turned, the segment ends at the next third of the period, and the next one goes to where the
// voices would have been a third later, between the two keyframes, as heard by the head as it is
// now. A head that turns steadily is so heard to turn steadily, a third of a period late.
#include <algorithm>
#include <cassert>

#include "runtime/mixing/mixer.h"

namespace clamor {

namespace {

constexpr double kWholeFrame = 4294967296.0;  // of positions, 32.32

constexpr int kThird_frames = kKeyframeFrames / 3;

// More voices than these turn with keyframes only: taking them anew would fill a short block.
constexpr std::size_t kMaxTurning = 5000;

}  // namespace

void Mixer::make_room_for_turns() {
  const std::size_t most = std::min(slots_.size(), kMaxTurning);
  for (Kept* const kept : {&previous_, &current_}) {
    kept->voices.resize(most);  // touches the memory, which the audio thread may not do first
    kept->voices.clear();
  }
  previous_at_.resize(slots_.size());
}

// A copy, since the keyframe's place is filled anew meanwhile.
void Mixer::keep(const Keyframe& keyframe) noexcept REALTIME {
  std::swap(previous_, current_);
  current_.voices.clear();
  current_.facing = keyframe.facing;
  if (keyframe.voices.size() > current_.voices.capacity()) {
    previous_.voices.clear();
    return;
  }
  current_.voices.assign(keyframe.voices.begin(), keyframe.voices.end());
  for (std::uint32_t v = 0; v < previous_.voices.size(); ++v)
    previous_at_[previous_.voices[v].slot] = v;
}

bool Mixer::has_turned() const noexcept REALTIME {
  return turns_ != nullptr && facing_.is_known && facing_ != applied_ && !current_.voices.empty() &&
         !previous_.voices.empty() && left_out_ == 0;
}

bool Mixer::turn() noexcept REALTIME {
  const int at = elapsed_ + frame_;
  if (turns_ == nullptr || holding_ || at == kKeyframeFrames) return false;
  const bool ends = frame_ == segment_.frames;
  const bool cuts = at > 0 && at % kThird_frames == 0 && has_turned();
  if (!ends && !cuts) return false;
  if (!ends) cut();
  load_segment(current_.voices, at, cuts ? kThird_frames : kKeyframeFrames - at);
  return true;
}

bool Mixer::rotate_while_holding() noexcept REALTIME {
  assert(wants_keyframe());
  if (!has_turned()) return false;
  if (holding_) end_hold();
  load_segment(current_.voices, kKeyframeFrames - kThird_frames, kThird_frames);
  return true;
}

// Makes where gains and delays are now the end of their segment.
void Mixer::cut() noexcept REALTIME {
  const float here = static_cast<float>(frame_) / kGainFrames;
  const int to_knot = std::max(0, segment_.knot - frame_);
  const int after_knot = segment_.frames - frame_ - to_knot;
  for (const std::uint32_t s : active_) {
    change_gains(s, [here](float* target, const float* gain, std::size_t lanes) noexcept REALTIME {
      for (std::size_t lane = 0; lane < lanes; ++lane)
        target[lane] = gain[lane] + here * gain[lanes + lane];
    });
    Slot& slot = slots_[s];
    for (std::size_t e = 0; e < static_cast<std::size_t>(mode_.delays); ++e) {
      VoicePath path = paths_[s * kEars + e];
      slot.slide[e].end = 1 - static_cast<double>(path.step) / kWholeFrame;
      path.position = 0;
      std::int64_t way = path.position_at(to_knot);
      if (to_knot > 0) {
        path.step = slot.after_knot[e].step;
        path.bend = slot.after_knot[e].bend;
      }
      way += path.position_at(after_knot);
      slot.delay[e] += way - (std::int64_t{to_knot + after_knot} << 32);
    }
    if (mode_.head) gap_ends_[s] = gaps_[s].ahead;
  }
}

// Where it is to be when the segment ends, for the head as it is now.
Voice Mixer::interpolated_voice(const Voice& voice, const HeadRotation::Turn& turn,
                                const HeadRotation::Turn& previous_turn) const noexcept REALTIME {
  Voice now = voice;
  turn.apply(now);
  if (elapsed_ > 0) now.starts = false;
  if (elapsed_ + segment_.frames == kKeyframeFrames) return now;
  const double along = static_cast<double>(elapsed_ + segment_.frames) / kKeyframeFrames;
  const auto share = static_cast<float>(along);
  const std::uint32_t at = previous_at_[voice.slot];
  const bool was_there =
      !voice.starts && at < previous_.voices.size() && previous_.voices[at].slot == voice.slot;
  Voice before = was_there ? previous_.voices[at] : now;
  if (was_there) {
    previous_turn.apply(before);
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
