// keyframe_pacing.h: from the time that keyframes take: how early to begin the next one, and how
// many sources it may have.
//
// Threads: the sampler's; the counters on any.
#pragma once

#include <cstdint>

#include "runtime/engine/auralizer_options.h"
#include "runtime/mixing/block_mixer.h"
#include "runtime/mixing/keyframe_lead.h"
#include "runtime/mixing/load_control.h"

namespace clamor {

class KeyframePacing {
 public:
  // `max_voices` is the largest sample. `settled` is the first keyframe whose time counts.
  KeyframePacing(const AuralizerOptions& options, std::size_t max_voices, std::uint64_t settled)
      : clock_(options.sampler_clock),
        adapting_(options.adapt),
        settled_(settled),
        load_(max_voices),
        lead_(options.sampler_period_s) {}

  double now_s() const { return clock_.now(); }

  // The next keyframe must be begun this long before it is due.
  double lead_s() const { return lead_.seconds(); }

  // Records that keyframe `number` took `spent_s`, of which `own_s` is its own part: a sample that
  // serves several keyframes is shared among them. Returns whether voices() may have changed.
  bool made(std::uint64_t number, double spent_s, double own_s, const BlockMixer& mixer);

  std::size_t voices() const { return load_.voices(); }
  std::size_t min_voices() const { return load_.min_so_far(); }
  std::uint64_t late_keyframes() const { return load_.late(); }

 private:
  const LoadClock clock_;
  const bool adapting_;
  const std::uint64_t settled_;
  SamplerLoadControl load_;
  KeyframeLead lead_;
};

}  // namespace clamor
