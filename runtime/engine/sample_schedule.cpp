#include "runtime/engine/sample_schedule.h"

#include <algorithm>

#include "runtime/occlusion/visibility_cache.h"
#include "runtime/sampling/sampling_strategy.h"

namespace clamor {

std::size_t keyframes_per_sample(std::size_t voices) {
  return std::clamp<std::size_t>(
      (voices + kVoicesPerKeyframeOfSample - 1) / kVoicesPerKeyframeOfSample, 1,
      kMaxKeyframesPerSample);
}

SampleSchedule::SampleSchedule(SamplingPipeline& pipeline, const AuralizerOptions& options,
                               std::size_t keyframes, std::size_t coarsest)
    : pipeline_(pipeline),
      script_(options.script),
      wait_for_pages_(options.wait_for_pages),
      clock_(options.sampler_clock),
      shares_(!strategy_options_of(options).needs_list() && pipeline.moving() == nullptr &&
              (script_ == nullptr || script_->parts().empty())),
      spacing_{shares_ ? keyframes : 1,
               shares_ ? std::max(kMaxKeyframesPerSample, coarsest * keyframes) : coarsest},
      keyframes_(spacing_.least) {}

std::span<const SampledSource> SampleSchedule::sample(std::uint64_t number,
                                                      const Listener& listener,
                                                      const Reception& reception, double time_s) {
  if (!is_due(number)) return sample_;
  if (script_ != nullptr)  // its own sources and parts, which have been checked
    (void)script_->apply(pipeline_.moving(), pipeline_.stage(), time_s);
  pipeline_.update_parts();
  Sampler& sampler = pipeline_.sampler();
  sampler.set_reception(reception);
  serves_ = number > 0 ? keyframes_ : 1;
  const WorkTime start_s = serves_ > 1 ? clock_.work() : WorkTime();
  const auto is_stopped = [this] {
    return stop_ != nullptr && stop_->load(std::memory_order_relaxed);
  };
  sample_ = sampler.sample(listener, time_s);
  while (wait_for_pages_ && !is_stopped() && !sampler.complete())
    sample_ = sampler.sample(listener, time_s);
  next_ = number + serves_;
  took_s_ = serves_ > 1 ? clock_.work() - start_s : WorkTime();
  return sample_;
}

void SampleSchedule::warm_up(const Listener& listener, const Reception& reception, double time_s) {
  const auto untested = [this] {
    return pipeline_.occlusion() == nullptr ? 0 : pipeline_.occlusion()->statistics().late;
  };
  for (int i = 0; i < kMaxWarmUps; ++i) {
    const std::uint64_t untested_before = untested();
    (void)sample(0, listener, reception, time_s);
    expire();
    if (pipeline_.sampler().complete() && untested() == untested_before) return;
  }
}

void SampleSchedule::stop_when(const std::atomic<bool>* stop) {
  stop_ = stop;
  pipeline_.sampler().stop_when(stop);
}

MovingSources* SampleSchedule::moving() const {
  return script_ == nullptr ? pipeline_.moving() : nullptr;
}

MovingParts* SampleSchedule::parts() const {
  return script_ == nullptr || script_->parts().empty() ? pipeline_.parts() : nullptr;
}

}  // namespace clamor
