// sample_schedule.h: when the sources are sampled: for each keyframe or, for large crowds and where
// other programs have the cores, for several at a time.
//
// Beside a field only a few of the sources are voices, and the others take part whatever their
// rank. Once sources are known and tested, a sample serves as many keyframes as the listener takes
// for a step of kFieldStep_m, at most kMaxKeyframesPerFieldSample, and in between the occlusion of
// the voices alone is renewed.
//
// Threads: the sampler's.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>

#include "common/listener.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/sampling_pipeline.h"
#include "runtime/mixing/load_control.h"
#include "runtime/propagation/reception.h"
#include "runtime/sampling/moving_script.h"
#include "runtime/sampling/sampler.h"

namespace clamor {

// Returns how many keyframes one sample of so many voices serves.
std::size_t keyframes_per_sample(std::size_t voices);

inline constexpr std::size_t kMaxKeyframesPerFieldSample = 32;
inline constexpr double kFieldStep_m = 0.5;

// This number of keyframes finds most of the sound of a room (0.3 s).
inline constexpr int kMaxWarmUps = 16;

class SampleSchedule {
 public:
  // `pipeline` must outlive this. A sample serves `keyframes` if sources only move with the
  // listener, and otherwise one. Where time is short, what is made of samples may be made
  // `coarsest` times less often, which is above 1 beside a field.
  SampleSchedule(SamplingPipeline& pipeline, const AuralizerOptions& options, std::size_t keyframes,
                 std::size_t coarsest);

  // The sample for keyframe `number`, new or from a few keyframes before, with the occlusion of
  // `voices` (ascending numbers) renewed.
  std::span<const SampledSource> sample(std::uint64_t number, const Listener& listener,
                                        const Reception& reception, double time_s,
                                        std::span<const std::uint64_t> voices);
  // Before the first keyframe: samples until all pages have arrived and all new sources were tested
  // for occlusion, at most kMaxWarmUps times.
  void warm_up(const Listener& listener, const Reception& reception, double time_s);
  // The next call of sample() samples anew.
  void expire() { next_ = 0; }
  // Movable parts must be heard at once, so that their changes need a new sample.
  bool is_due(std::uint64_t number, const Listener& listener) const;

  // A keyframe's part of the time `spent_s`, if the sample was new or not: the time of sampling is
  // shared among the keyframes that a sample serves.
  WorkTime part_s(const WorkTime& spent_s, bool sampled) const {
    return spent_s - (sampled ? took_s_ : WorkTime()) +
           took_s_ * (1.0 / static_cast<double>(serves_));
  }

  // How many keyframes a sample serves by the requested number of voices, and how many it may.
  SamplerLoadControl::Spacing spacing() const { return spacing_; }
  // A sample serves `keyframes` from the next one on, and of the newest one's time only the share
  // `kept` counts in the keyframes that are left to it (keyframe_pacing.h).
  void space(std::size_t keyframes, double kept) {
    keyframes_ = shares_ ? keyframes : 1;
    took_s_ = took_s_ * kept;
  }

  void stop_when(const std::atomic<bool>* stop);

  // Sources that the caller moves; null if there are none, or if a script moves them.
  MovingSources* moving() const;
  // Movable parts in the same way.
  MovingParts* parts() const;

 private:
  std::size_t keyframes_of_step(const Listener& listener) const;

  SamplingPipeline& pipeline_;
  const std::shared_ptr<MovingScript> script_;
  const bool wait_for_pages_;
  const LoadClock clock_;
  const bool shares_;  // samples
  const bool has_field_;
  const SamplerLoadControl::Spacing spacing_;
  // The number of keyframes that one sample serves. With fewer voices, sampling is hardly faster,
  // so this number does not fall with them.
  std::size_t keyframes_;
  const std::atomic<bool>* stop_ = nullptr;
  std::span<const SampledSource> sample_;  // the sampler's
  Vec3 place_m_{};                         // of its listener
  std::uint64_t next_ = 0;                 // keyframe with the next sample
  std::uint64_t soonest_ = 0;              // that may have it, or with renewed voices
  std::size_t serves_ = 1;                 // keyframes
  WorkTime took_s_;                        // if it serves several, as far as it counts
};

}  // namespace clamor
