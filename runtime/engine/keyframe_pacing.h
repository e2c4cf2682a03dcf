// keyframe_pacing.h: from the time that keyframes take: how early to begin the next one, and how
// many sources it may have.
//
// Threads: the sampler's.
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
  KeyframePacing(const AuralizerOptions& options, std::size_t max_voices,
                 SamplerLoadControl::Spacing spacing, std::uint64_t settled)
      : clock_(options.sampler_clock),
        adapting_(options.adapt),
        leads_(options.adapt || options.tracks_head),
        settled_(settled),
        least_spacing_(spacing.least),
        load_(max_voices, spacing),
        lead_(options.sampler_period_s) {}

  WorkTime now_s() const { return clock_.work(); }

  // The next keyframe must be begun this long before it is due. Offline it need not.
  double lead_s() const { return leads_ ? lead_.seconds() : 0; }
  double max_lead_s() const { return max_lead_s_; }  // so far

  // Records that keyframe `number` took `spent_s`, of which `part_s` is its own part: a sample that
  // serves several keyframes is shared among them. Returns whether load() may have changed.
  bool made(std::uint64_t number, const WorkTime& spent_s, const WorkTime& part_s,
            const BlockMixer& mixer);

  const SamplerLoadControl& load() const { return load_; }
  // How many times less often than at first samples are taken, at least.
  std::size_t coarseness() const { return load_.spacing() / least_spacing_; }
  // The share of the work so far that is left to answer after the newest keyframe: where the load
  // control reduced the work by a factor, the work before it counts by that factor from then on.
  double kept() const { return kept_; }
  // The mean of work that some keyframes have much of and others none, as far as it is not
  // answered.
  WorkTime mean_s(const WorkTime& newest_s) {
    return mean_s_ = mean_s_ + (newest_s - mean_s_) * (1.0 / kMeanKeyframes);
  }

 private:
  const LoadClock clock_;
  const bool adapting_, leads_;
  static constexpr int kMeanKeyframes = 8;

  const std::uint64_t settled_;
  const std::size_t least_spacing_;
  SamplerLoadControl load_;
  WorkTime mean_s_;
  double kept_ = 1;
  KeyframeLead lead_;
  double max_lead_s_ = 0;
};

}  // namespace clamor
