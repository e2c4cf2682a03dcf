// mixer_streaming.cpp: how the mixer handles signals that are not resident yet (sound_loader.h).
//
// A voice plays a segment only if all pieces that it reads in it and in the next one are resident.
// Otherwise it ramps to silence in this segment or, if not even this segment's pieces are resident,
// is muted at once. It comes back with a ramp from silence to its gains in one segment. While the
// mixer holds, it looks as far ahead at each step.
#include <algorithm>

#include "runtime/mixing/mixer.h"

namespace clamor {

namespace {
constexpr std::uint8_t kStepsToSilence = kKeyframeFrames / kStepFrames;
}

// Returns whether the pieces that the voice reads in the next `frames` frames are resident, while
// its delays move from `from` (40.24).
bool Mixer::is_resident(std::uint32_t s, const std::array<std::int64_t, kEars>& from,
                        const std::array<double, kEars>& change_frames,
                        int frames) const noexcept REALTIME {
  const PreparedSignal& signal = *slots_[s].signal;
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  std::int64_t last = std::numeric_limits<std::int64_t>::min();
  for (std::size_t e = 0; e < static_cast<std::size_t>(mode_.delays); ++e) {
    const std::int64_t at = time_.clock_frames + lead_frames_ - (from[e] >> kDelayBits);
    first = std::min(first, at - 2);
    last = std::max(last, at + frames + 2 - static_cast<std::int64_t>(change_frames[e]));
  }
  return signal.is_resident(first, last);
}

// Returns whether a voice may be audible in the segment that begins. If not, it counts as late.
bool Mixer::may_sound(std::uint32_t s, const std::array<std::int64_t, kEars>& from,
                      const std::array<double, kEars>& change_frames) noexcept REALTIME {
  Slot& slot = slots_[s];
  if (!slot.signal->streams()) return true;
  // Up to the end of the next period.
  if (is_resident(s, from, change_frames, 2 * kKeyframeFrames - time_.elapsed)) return true;
  ++muted_.late;
  if (!is_resident(s, from, change_frames, time_.segment.frames)) silence(s);
  return false;
}

void Mixer::silence(std::uint32_t s) noexcept REALTIME {
  change_gains(s, [](float* target, float* gain, std::size_t lanes) noexcept REALTIME {
    std::fill_n(target, lanes, 0.0f);
    std::fill_n(gain, 2 * lanes, 0.0f);
  });
  slots_[s].audible = false;
  slots_[s].steps_to_silence = 0;
}

// One step of holding; every voice is at the beginning of a step. Returns true while a voice fades
// out: then the step must have kStepFrames, otherwise it may have kShedFrames.
bool Mixer::hold_sounds() noexcept REALTIME {
  bool ended = false, falling = false;
  for (const std::uint32_t s : active_) {
    Slot& slot = slots_[s];
    if (!slot.signal->streams()) continue;
    const bool falls = slot.steps_to_silence > 0;
    if (!falls && is_resident(s, slot.delay, {}, kKeyframeFrames + kShedFrames)) continue;
    muted_.late += !falls;
    slot.steps_to_silence =
        falls ? static_cast<std::uint8_t>(slot.steps_to_silence - 1) : kStepsToSilence;
    if (slot.steps_to_silence == 0 || !is_resident(s, slot.delay, {}, kStepFrames)) {
      silence(s);
      ended = true;
      continue;
    }
    falling = true;
    // Gains count from frame 0 of the segment, and this step is its last.
    constexpr float kUnits = static_cast<float>(kKeyframeFrames - kStepFrames) / kGainFrames;
    constexpr float kSlope = -1.0f * kGainFrames / kStepFrames / kStepsToSilence;
    const float now = static_cast<float>(slot.steps_to_silence) / kStepsToSilence;
    change_gains(s, [now](const float* target, float* gain, std::size_t lanes) noexcept REALTIME {
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        gain[lane] = target[lane] * (now - kSlope * kUnits);
        gain[lanes + lane] = target[lane] * kSlope;
      }
    });
  }
  if (!ended) return falling;
  drop_if([this](std::uint32_t s) { return !slots_[s].audible; });
  return falling;
}

// Before the next segment: continues from the gains at which holding ended.
void Mixer::end_hold() noexcept REALTIME {
  for (const std::uint32_t s : active_) {
    Slot& slot = slots_[s];
    if (slot.steps_to_silence == 0) continue;
    const float now = static_cast<float>(slot.steps_to_silence - 1) / kStepsToSilence;
    change_gains(s, [now](float* target, float*, std::size_t lanes) noexcept REALTIME {
      for (std::size_t lane = 0; lane < lanes; ++lane) target[lane] *= now;
    });
    slot.steps_to_silence = 0;
  }
}

}  // namespace clamor
