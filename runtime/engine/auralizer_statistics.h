// auralizer_statistics.h: what an auralizer counts while it runs.
#pragma once

#include <cstdint>

#include "runtime/mixing/block_statistics.h"
#include "runtime/streaming/page_statistics.h"
#include "runtime/streaming/sound_statistics.h"

namespace clamor {

// Counts of the sampler's thread, up to the newest keyframe.
struct SamplerStatistics {
  std::uint64_t keyframes = 0;  // made
  std::uint32_t voices = 0;     // including those that fade
  std::uint32_t taps = 0;       // sources that a field sounds instead
  double sampler_ms = 0;        // CPU time of the keyframe
  std::uint64_t rays = 0;
  std::uint64_t late_sources = 0;       // left out because their visibility was not known in time
  std::uint64_t bounded_keyframes = 0;  // whose search was ended by the budget of work (sampler.h)
  // Moving sources without reflections, because they see no probe: now, and most at a time.
  std::uint32_t unseen_sources = 0, max_unseen_sources = 0;
  // Load shedding: k is the number of chosen sources; the mixer sheds voices.
  std::uint32_t k = 0, min_k = 0, max_k = 0;  // current, smallest so far, requested
  std::uint64_t late_keyframes = 0;           // took longer than their period; not the first
  std::uint64_t starved_keyframes = 0;        // of these, those that other programs made late
  double waiting_share = 0;  // of its time that the sampler's or the audio thread waits for a core
  std::uint32_t keyframes_per_sample = 1;  // now
  double lead_s = 0, max_lead_s = 0;       // how early keyframes are begun: now, and earliest
};

struct AuralizerStatistics : SamplerStatistics, BlockStatistics {
  PageStatistics pages{};
  SoundStatistics sounds{};
};

}  // namespace clamor
