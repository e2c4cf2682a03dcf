// priority_sampler.cpp: the k sources of highest priority.
#include <algorithm>
#include <deque>
#include <optional>
#include <utility>

#include "runtime/sampling/candidate_set.h"
#include "runtime/sampling/sampler.h"
#include "runtime/sampling/sampling_inputs.h"
#include "runtime/sampling/threshold_search.h"

namespace clamor {

namespace {

// The rotation that turns one unit vector to another by the shortest way.
Quaternion turn_between(const Vec3& from, const Vec3& to) {
  const double cosine = dot(from, to);
  if (cosine < -1 + 1e-9) {
    const Vec3 axis = basis_around(from).tangent;
    return {0, axis.x, axis.y, axis.z};
  }
  const Vec3 axis = cross(from, to);
  return glm::normalize(Quaternion(1 + cosine, axis.x, axis.y, axis.z));
}

// Lets a direct sound be heard from where it comes around an edge: there it has the distance of its
// way, and emission and movement are turned so that they are as in the direction in which it left.
void bend(SampledSource& sampled, const BentPath& path, const Vec3& place_m, Source& source) {
  const Vec3 away_m = place_m - Vec3(path.heard_at_m);
  const double straight_m = length(place_m - Vec3(source.position_m)), path_m = length(away_m);
  if (!(straight_m > 0 && path_m > 0)) return;
  const Quaternion turn = turn_between(Vec3(path.leaves), away_m / path_m);
  source.position_m = path.heard_at_m;
  source.normal = Vec3f(turn * Vec3(source.normal));
  sampled.source = &source;
  sampled.velocity_mps = Vec3f(turn * Vec3(sampled.velocity_mps));
  sampled.moves = true;
  // Occlusion is relative to the straight line's distance.
  sampled.factors.detour = static_cast<float>(path_m * path_m / (straight_m * straight_m));
}

class PrioritySampler final : public Sampler {
 public:
  PrioritySampler(const RadiationModel& radiation, SignalWeights weights, SourcePool& pool,
                  std::size_t voices, VisibilityCache* occlusion, SearchBound bound)
      : inputs_{radiation, std::move(weights), pool, occlusion, voices},
        occlusion_(occlusion),
        max_voices_(voices),
        bound_(bound),
        candidates_(inputs_),
        search_(inputs_, candidates_, bound) {
    pool.charge(&inputs_.budget);
  }
  ~PrioritySampler() override { inputs_.pool.charge(nullptr); }
  PrioritySampler(const PrioritySampler&) = delete;
  PrioritySampler& operator=(const PrioritySampler&) = delete;

  // The sample depends on the place, the time and the pages in memory alone. With steady signals a
  // listener who stands still costs nothing once the occlusion of all candidates is known.
  //
  // An exact sampler waits for pages and is called again whenever some have arrived. So that the
  // sample does not depend on when they do, no visibility is estimated before all pages that reach
  // the threshold are in memory, and a repeated call continues the search.
  std::span<const SampledSource> sample(const Listener& listener, double time_s) override {
    SourcePool& pool = inputs_.pool;
    const Vec3& place = listener.position_m;
    update_occlusion(place);
    VisibilityCache* const occlusion = inputs_.occlusion;
    const bool has_moved = !moment_ || moment_->place_m != place;
    const bool lacked_sounds = std::exchange(may_lack_sounds_, inputs_.may_lack_sounds());
    const bool is_another = changed_ || has_moved || lacked_sounds || may_lack_sounds_ ||
                            (occlusion != nullptr && occlusion->has_changed_parts()) ||
                            moment_->reception != reception() ||
                            (!inputs_.weights.steady() && moment_->time_s != time_s);
    if (!pool.refresh() && !is_another && !unfinished_) return sample_;
    const bool continues = inputs_.is_exact() && !is_another;
    if (!continues) search_.restart(has_moved);
    changed_ = false;
    moment_.emplace(SamplingMoment{place, time_s, reception()});
    // An exact sampler estimates visibilities anew for this place.
    const bool is_cached = occlusion != nullptr && !inputs_.is_exact();
    pool.begin({listener, time_s, is_cached ? &occlusion->upper_bounds() : nullptr,
                LateBoost::strength(inputs_.voices)});
    if (occlusion != nullptr && !continues) occlusion->begin_keyframe(place);
    const std::uint64_t late_before = occlusion != nullptr ? occlusion->statistics().late : 0;
    const auto [tau, ended_by_budget] = search_.run(*moment_);
    bounded_keyframes_ += ended_by_budget;
    publish(tau);
    lacks_rays_ = occlusion != nullptr && occlusion->statistics().late != late_before;
    ended_by_budget_ = ended_by_budget;
    if (bound_ == SearchBound::kBounded)
      inputs_.budget.limit(work_ahead_per_keyframe(inputs_.voices));
    pool.request_pages(tau);
    if (inputs_.is_exact()) {
      unfinished_ = search_.waits_for_pages();
    } else {
      const bool learns = occlusion != nullptr && occlusion->refresh(candidates_.wanted(), tau);
      unfinished_ = learns || ended_by_budget;
    }
    return sample_;
  }

  void renew(std::span<const std::uint64_t> numbers, const Listener& listener) override {
    VisibilityCache* const occlusion = inputs_.occlusion;
    if (occlusion == nullptr) return;
    wanted_.clear();
    renewed_.clear();
    auto at = sample_.begin();
    for (const std::uint64_t number : numbers) {
      at = std::ranges::lower_bound(at, sample_.end(), number, {}, &SampledSource::number);
      if (at == sample_.end()) break;
      const auto index = static_cast<std::size_t>(at - sample_.begin());
      const Candidate& chosen = candidates_[index];
      if (at->number != number || !chosen.is_occlusion_applied) continue;
      wanted_.push_back(candidates_.wanted_of(chosen));
      renewed_.push_back(index);
    }
    occlusion->renew_at(listener.position_m, wanted_);
    for (const std::size_t index : renewed_) {
      SampledSource& sampled = sample_[index];
      const FoundSource& found = candidates_.source_of(candidates_[index]);
      sampled.source = found.source;  // straight, unless it is bent again
      sampled.factors.detour = 1;
      sampled.moves = false;
      sampled.velocity_mps = {};
      if (found.voice != 0) sampled.set_moving(found);
      apply_occlusion(sampled, candidates_[index], listener.position_m);
    }
  }

  bool is_settled() const override {
    return !changed_ && !lacks_rays_ && !ended_by_budget_ && !inputs_.pool.lacks_pages() &&
           candidates_.unheard().empty();
  }

  bool complete() override {
    const bool is_complete = inputs_.pool.complete();
    if (!is_complete || !search_.waits_for_pages()) return is_complete;
    search_.stop_waiting();  // what is missing does not arrive
    return false;
  }

  std::size_t capacity() const override {
    return static_cast<std::size_t>(std::min<std::uint64_t>(max_voices_, inputs_.pool.size()));
  }

  void stop_when(const std::atomic<bool>* stop) override { inputs_.budget.stop_when(stop); }

  std::uint64_t work() const override { return inputs_.budget.spent(); }
  std::uint64_t bounded_keyframes() const override { return bounded_keyframes_; }

  void set_voice_count(std::size_t voices) override {
    voices = std::clamp<std::size_t>(voices, 1, max_voices_);
    if (voices == inputs_.voices) return;
    search_.rescale(inputs_.voices, voices);
    inputs_.voices = voices;
    changed_ = true;
  }

  void set_sounds(const SoundLoader* sounds) override { inputs_.sounds = sounds; }
  std::span<const WantedSound> unheard() const override { return candidates_.unheard(); }

  void set_emitter_powers(std::vector<float> powers) override {
    inputs_.emitter_powers = std::move(powers);
    changed_ = true;
  }

 private:
  // Makes the sample of the k highest candidates, `tau` being the next priority.
  void publish(double tau) {
    sample_.clear();
    bent_sources_.clear();
    const std::size_t count = std::min(inputs_.voices, candidates_.size());
    candidates_.sort_by_number(count);
    for (std::size_t c = 0; c < count; ++c) {
      const Candidate& chosen = candidates_[c];
      candidates_.prefetch_visibility_after(c);
      const FoundSource& found = candidates_.source_of(chosen);
      const Source& source = *found.source;
      double scale = std::max(found.min_scale, tau / (chosen.weight * found.boost));
      if (const double key = inputs_.pool.missing_key(found, tau); key > 0)
        scale = std::max(scale, key / sum_of(source.power));
      const GainFactors factors{.portals = found.openness, .emitter = inputs_.emitter_power(found)};
      sample_.push_back({found.number, scale, &source, found.signal, factors,
                         chosen.priority > 0 ? std::min(1.0, tau / chosen.priority) : 1.0});
      sample_.back().weight = chosen.weight * scale;
      if (found.voice != 0) sample_.back().set_moving(found);
      if (chosen.is_occlusion_applied) apply_occlusion(sample_.back(), chosen, moment_->place_m);
    }
  }

  void apply_occlusion(SampledSource& sampled, const Candidate& chosen, const Vec3& place_m) {
    sampled.factors.occlusion = inputs_.occlusion->visibility(chosen.visibility);
    if (const auto path = inputs_.occlusion->bent_path(chosen.visibility))
      bend(sampled, *path, place_m,
           bent_sources_.emplace_back(*candidates_.source_of(chosen).source));
  }

  // In a free field the cache is not asked until a movable part is added.
  void update_occlusion(const Vec3& place) {
    if (occlusion_ == nullptr) return;
    inputs_.occlusion = occlusion_->occludes() ? occlusion_ : nullptr;
    if (inputs_.occlusion != nullptr || !occlusion_->has_changed_parts()) return;
    changed_ = true;
    occlusion_->begin_keyframe(place);
  }

  SamplingInputs inputs_;
  VisibilityCache* const occlusion_;  // or null
  const std::size_t max_voices_;
  const SearchBound bound_;
  CandidateSet candidates_;
  ThresholdSearch search_;
  std::optional<SamplingMoment> moment_;  // of sample_
  bool changed_ = false;                  // the number of voices or a power, since sample_
  bool unfinished_ = false;               // another call may improve sample_
  bool lacks_rays_ = false, ended_by_budget_ = false;  // the last search
  bool may_lack_sounds_ = false;  // some sounds may not have been in memory for sample_
  std::uint64_t bounded_keyframes_ = 0;
  std::vector<SampledSource> sample_;
  std::vector<VisibilityCache::Wanted> wanted_;  // scratch memory of renew()
  std::vector<std::size_t> renewed_;             // likewise
  std::deque<Source> bent_sources_;              // copies that sample_ refers to
};

}  // namespace

std::unique_ptr<Sampler> make_priority_sampler(const RadiationModel& radiation,
                                               SignalWeights weights, SourcePool& pool,
                                               std::size_t voices, VisibilityCache* occlusion,
                                               SearchBound bound) {
  return std::make_unique<PrioritySampler>(radiation, std::move(weights), pool, voices, occlusion,
                                           bound);
}

}  // namespace clamor
