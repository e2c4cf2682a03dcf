// auralizer_statistics.h: counts and levels of an auralizer, for displays and reports.
#pragma once

#include <cstdint>

#include "runtime/mixing/limiter.h"
#include "runtime/mixing/panner.h"
#include "runtime/streaming/page_loader.h"
#include "runtime/streaming/sound_loader.h"

namespace clamor {

struct AuralizerStatistics {
  std::uint64_t keyframes = 0;          // made
  std::uint64_t held_blocks = 0;        // mixed without a new keyframe when one was due
  std::uint32_t voices = 0;             // in the newest keyframe, fading ones included
  double sampler_ms = 0;                // the last make_keyframe took
  float peak[kMaxChannels] = {};        // largest sample since the last call of statistics()
  std::uint64_t clipped_frames = 0;     // frames beyond full scale so far
  Limiter::Work limited;                // what the limiter did so far
  std::uint64_t bad_voices = 0;         // silenced for a keyframe: a gain or delay was not finite
  std::uint64_t rays = 0;               // cast so far
  std::uint64_t late_sources = 0;       // times a source was left out for want of rays
  std::uint64_t bounded_keyframes = 0;  // whose search for sources its budget ended (sampler.h)
  // What there was no time for. k is how many sources are chosen; the mixer leaves out voices.
  std::uint32_t k = 0, min_k = 0, max_k = 0;  // now, at least so far, asked for
  std::uint64_t late_keyframes = 0;  // took longer than what they are for lasts; not the first
  std::uint32_t shed_voices = 0, max_shed_voices = 0;  // left out now, and at most so far
  std::uint64_t shedding_blocks = 0;                   // mixed without all voices
  PageStatistics pages{};
  SoundStatistics sounds{};
};

}  // namespace clamor
