// mixer_timeline.h: where the mixer is: its clock, and the segment that leads to the next keyframe.
//
// A period lasts from one keyframe to the next. It is one segment, or several if voices follow head
// rotation in between.
//
// Threads: the audio thread's.
#pragma once

#include <algorithm>
#include <cstdint>

#include "runtime/realtime/realtime.h"
#include "runtime/voices/keyframe.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

// A period or a part of one. Gains are linear in it; delays follow two parabolas of m and n steps
// that meet at the knot.
struct MixerSegment {
  int frames = 0, knot = 0;
  double per_frame = 0, per_m = 0, per_n = 0, share_m = 0, share_n = 0;

  static constexpr MixerSegment of(int frames, int knot) noexcept REALTIME {
    const double m = 1.0 * knot / kStepFrames, n = 1.0 * frames / kStepFrames - m;
    return {frames, knot, 1.0 / frames, 1 / m, 1 / n, m / (m + n), n / (m + n)};
  }
  static constexpr MixerSegment whole() noexcept REALTIME { return of(kKeyframeFrames, 512); }
};

struct MixerTimeline {
  static constexpr int kThird_frames = kKeyframeFrames / 3;

  std::int64_t clock_frames = 0;
  MixerSegment segment = MixerSegment::whole();
  int elapsed = 0;       // frames of the period before the segment
  int frame = 0;         // of the segment
  int shed_end = 0;      // the frame at which shed voices have faded out
  bool holding = false;  // slopes are 0 until the next keyframe

  bool is_at_end() const noexcept REALTIME { return frame == segment.frames; }
  int frames_left() const noexcept REALTIME { return kKeyframeFrames - elapsed - frame; }
  int frames_to_next_third() const noexcept REALTIME {
    return kThird_frames - (elapsed + frame) % kThird_frames;
  }
  // Until the slopes of gains or delays change.
  int frames_to_bend() const noexcept REALTIME {
    const int knot = frame < segment.knot ? segment.knot : segment.frames;
    return (frame < shed_end ? std::min(knot, shed_end) : knot) - frame;
  }

  void begin_segment(const MixerSegment& next, int elapsed_frames) noexcept REALTIME {
    segment = next;
    elapsed = elapsed_frames;
    frame = 0;
  }
  void advance(int frames) noexcept REALTIME {
    clock_frames += frames;
    frame += frames;
  }
};

}  // namespace clamor
