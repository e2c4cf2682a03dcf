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
      has_field_(coarsest > 1),
      spacing_{shares_ ? keyframes : 1,
               shares_ ? std::max(kMaxKeyframesPerSample, coarsest * keyframes) : coarsest},
      keyframes_(spacing_.least) {}

// What nobody foresaw makes a sample due, but no sooner than without a field.
bool SampleSchedule::is_due(std::uint64_t number, const Listener& listener) const {
  if (number >= next_ || pipeline_.has_new_parts()) return true;
  return has_field_ && number >= soonest_ &&
         (!pipeline_.sampler().is_settled() ||
          length(listener.position_m - place_m_) > kFieldStep_m);
}

// A multiple of keyframes_, at which a field's late taps are renewed.
std::size_t SampleSchedule::keyframes_of_step(const Listener& listener) const {
  if (!has_field_ || !shares_ || !pipeline_.sampler().is_settled()) return 1;
  const double step_m =
      static_cast<double>(keyframes_) * kKeyframe_s * length(listener.velocity_mps);
  const auto most = static_cast<double>(kMaxKeyframesPerFieldSample / keyframes_);
  return keyframes_ *
         static_cast<std::size_t>(std::min(most, kFieldStep_m / std::max(step_m, 1e-9)));
}

std::span<const SampledSource> SampleSchedule::sample(std::uint64_t number,
                                                      const Listener& listener,
                                                      const Reception& reception, double time_s,
                                                      std::span<const std::uint64_t> voices) {
  Sampler& sampler = pipeline_.sampler();
  if (!is_due(number, listener)) {
    if (has_field_ && number >= soonest_) {
      sampler.renew(voices, listener);
      soonest_ = number + keyframes_;
    }
    return sample_;
  }
  if (script_ != nullptr)  // its own sources and parts, which have been checked
    (void)script_->apply(pipeline_.moving(), pipeline_.stage(), time_s);
  pipeline_.update_parts();
  sampler.set_reception(reception);
  serves_ = number > 0 ? std::max(keyframes_, keyframes_of_step(listener)) : 1;
  const WorkTime start_s = serves_ > 1 ? clock_.work() : WorkTime();
  const auto is_stopped = [this] {
    return stop_ != nullptr && stop_->load(std::memory_order_relaxed);
  };
  sample_ = sampler.sample(listener, time_s);
  while (wait_for_pages_ && !is_stopped() && !sampler.complete())
    sample_ = sampler.sample(listener, time_s);
  next_ = number + serves_;
  soonest_ = number + std::min(serves_, keyframes_);
  place_m_ = listener.position_m;
  took_s_ = serves_ > 1 ? clock_.work() - start_s : WorkTime();
  return sample_;
}

void SampleSchedule::warm_up(const Listener& listener, const Reception& reception, double time_s) {
  const auto untested = [this] {
    return pipeline_.occlusion() == nullptr ? 0 : pipeline_.occlusion()->statistics().late;
  };
  for (int i = 0; i < kMaxWarmUps; ++i) {
    const std::uint64_t untested_before = untested();
    (void)sample(0, listener, reception, time_s, {});
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
