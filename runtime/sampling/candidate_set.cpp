#include "runtime/sampling/candidate_set.h"

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>

#include "runtime/occlusion/ray_timer.h"
#include "runtime/propagation/source_number.h"
#include "runtime/propagation/source_weight.h"

namespace clamor {

namespace {

constexpr std::size_t kPrefetchDistance = 24;  // in candidates
constexpr std::size_t kBatchSize = 32;         // sources whose intensities are computed together
// Number of visibilities that an exact search estimates together, at first and at most.
constexpr std::size_t kMinBatchEstimates = 256, kMaxBatchEstimates = 8192;

bool is_occluded(VisibilityCache::Index visibility) {
  return visibility != VisibilityCache::kUnknown && VisibilityCache::is_occluded(visibility);
}

}  // namespace

bool CandidateSet::find(double threshold, std::size_t max_found) {
  candidates_.clear();
  band_weights_.clear();
  found_.clear();
  wanted_.clear();
  unheard_.clear();
  return inputs_.pool.find_above(threshold, max_found, found_);
}

void CandidateSet::weigh(const SamplingMoment& moment, double threshold) {
  reached_ = 0;
  threshold_ = threshold;
  std::array<const Source*, kBatchSize> sources;
  std::array<ReceivedIntensity, kBatchSize> received;
  for (std::size_t first = 0; first < found_.size(); first += kBatchSize) {
    const std::size_t last = std::min(first + kBatchSize, found_.size());
    prefetch(last, std::min(last + kBatchSize, found_.size()));
    for (std::size_t f = first; f < last; ++f) sources[f - first] = found_[f].source;
    inputs_.radiation.receive(std::span(sources).first(last - first), moment.place_m,
                              received.data());
    for (std::size_t f = first; f < last; ++f)
      weigh_source(static_cast<std::uint32_t>(f), received[f - first], moment, threshold);
  }
}

// Prefetches found sources, which are far apart in memory.
void CandidateSet::prefetch(std::size_t first, std::size_t last) const {
  for (std::size_t f = first; f < last; ++f) {
    const Source* const source = found_[f].source;
    __builtin_prefetch(source);
    __builtin_prefetch(&source->power);
    if (inputs_.occlusion != nullptr) inputs_.occlusion->prefetch(found_[f].number);
  }
}

// Makes a candidate of a source if it reaches the threshold.
void CandidateSet::weigh_source(std::uint32_t index, const ReceivedIntensity& received,
                                const SamplingMoment& moment, double threshold) {
  const FoundSource& found = found_[index];
  const Source& source = *found.source;
  const LoudnessTrack::Moment signal =
      weights_at_distance(inputs_.radiation, inputs_.weights, found.signal, source,
                          received.distance_m, moment.time_s - found.start_s);
  const float power_share = inputs_.power_share(found);
  if (found.upper_bound * (signal.share * power_share) < threshold) return;
  Bands intensity = apply_reception(moment.reception, source, moment.place_m, received.intensity);
  for (float& band : intensity) band *= power_share;
  const double w = weighted_sum(signal.weights, intensity);
  const double per_weight = static_cast<double>(found.boost) / std::max(source.u, kMinU);
  const double priority = w * per_weight;
  if (!(w > 0 && priority >= threshold)) return;
  ++reached_;
  Candidate candidate{priority, w, per_weight, index};
  Bands by_band{};
  if (inputs_.occlusion != nullptr) {
    by_band = weighted(signal.weights, intensity);
    candidate.share = share_of_sum(by_band, scale_at_threshold(w, found));
    candidate.visibility =
        inputs_.is_exact() ? inputs_.occlusion->find_current(found.number, source, candidate.share)
                           : inputs_.occlusion->find(found.number);
  }
  if (is_occluded(candidate.visibility)) {
    // Which occluded sources the pool finds depends on the phase of their bounds.
    if (!inputs_.is_exact()) wanted_.push_back(wanted_of(candidate));
    return;
  }
  if (inputs_.may_lack_sounds()) {
    const double delay_s = found.start_s + inputs_.radiation.delay_s(source, received.distance_m);
    if (!inputs_.sounds->is_ready(found.signal, moment.time_s - delay_s)) {
      const double as_sampled = std::max(w, threshold / static_cast<double>(found.boost));
      unheard_.push_back({found.signal, delay_s, static_cast<float>(as_sampled)});
      return;
    }
  }
  candidates_.push_back(candidate);
  if (inputs_.occlusion != nullptr) band_weights_.push_back(by_band);
}

// The scale of a source's power if the threshold is the final one (sampler.h).
double CandidateSet::scale_at_threshold(double weight, const FoundSource& found) const {
  return std::max(1.0, threshold_ / (weight * static_cast<double>(found.boost)));
}

// The share that a source would have in the sum of all if it was not occluded, in the band in which
// that is largest; 1 if nothing else is heard.
float CandidateSet::share_of_sum(const Bands& weights, double scale) const {
  double share = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const double weight = scale * static_cast<double>(weights[b]);
    share = std::max(share, weight / std::max({weight, heard_before_[b], heard_[b], 1e-300}));
  }
  return static_cast<float>(share);
}

VisibilityCache::Wanted CandidateSet::wanted_of(const Candidate& candidate) const {
  const FoundSource& found = source_of(candidate);
  return {candidate.priority, found.number, candidate.visibility, found.source, candidate.share};
}

bool CandidateSet::apply_occlusion(double threshold) {
  apply_known_visibilities();
  const bool rays_left = test_untested();
  heard_before_ = std::exchange(heard_, {});
  std::erase_if(candidates_, [threshold](const Candidate& candidate) {
    return !(candidate.weight > 0 && candidate.priority >= threshold && candidate.priority > 0);
  });
  return rays_left;
}

void CandidateSet::prefetch_visibility_after(std::size_t c) const {
  const std::size_t index = c + kPrefetchDistance;
  if (index >= candidates_.size() || inputs_.occlusion == nullptr) return;
  if (const auto visibility = candidates_[index].visibility;
      visibility != VisibilityCache::kUnknown)
    inputs_.occlusion->prefetch_visibility(visibility);
}

// Applies known visibilities and lists the other candidates, highest first.
void CandidateSet::apply_known_visibilities() {
  untested_.clear();
  stale_.clear();
  highest_priorities_.clear();
  for (std::uint32_t c = 0; c < candidates_.size(); ++c) {
    const Candidate& candidate = candidates_[c];
    prefetch_visibility_after(c);
    if (candidate.visibility == VisibilityCache::kUnknown)
      untested_.push_back({candidate.priority, c});
    else if (inputs_.occlusion->is_stale(candidate.visibility))
      stale_.push_back({candidate.priority, c});
    else
      highest_priorities_.push_back(apply_visibility(c));
  }
  if (!stale_.empty()) renew_stale();
  std::sort(untested_.begin(), untested_.end(), std::greater<>());
}

// Renews the visibilities that a movable part has changed, and applies them: emitters and moving
// sources first, the loudest in front, and then reflections, highest priority first.
void CandidateSet::renew_stale() {
  const auto is_direct = [this](const Ranked& one) {
    const FoundSource& found = source_of(candidates_[one.second]);
    return found.source->is_emitter || is_moving_source(found.number);
  };
  const auto reflections = std::partition(stale_.begin(), stale_.end(), is_direct);
  std::sort(stale_.begin(), reflections, [this](const Ranked& a, const Ranked& b) {
    const double weights[] = {candidates_[a.second].weight, candidates_[b.second].weight};
    return weights[0] != weights[1] ? weights[0] > weights[1] : a > b;
  });
  std::sort(reflections, stale_.end(), std::greater<>());
  renewed_.clear();
  for (const auto& [priority, c] : stale_) renewed_.push_back(wanted_of(candidates_[c]));
  inputs_.occlusion->renew(renewed_);
  for (const auto& [priority, c] : stale_) highest_priorities_.push_back(apply_visibility(c));
}

// Tests candidates of unknown visibility until k + 1 tested ones are ahead of all others, and
// leaves the others without priority. False if no rays were left.
bool CandidateSet::test_untested() {
  if (untested_.empty()) return true;
  const RayTimer time(inputs_.occlusion->ray_ms());
  keep_highest_priorities();
  bool rays_left = true;
  std::size_t next = 0, estimated_end = 0, batch = kMinBatchEstimates;
  for (; next < untested_.size(); ++next) {
    const auto [unoccluded_priority, c] = untested_[next];
    if (highest_priorities_.size() > inputs_.voices &&
        highest_priorities_.front() > unoccluded_priority)
      break;
    const FoundSource& found = source_of(candidates_[c]);
    VisibilityCache::Index& visibility = candidates_[c].visibility;
    if (inputs_.is_exact()) {
      if (next == estimated_end) {
        if (inputs_.budget.is_stopped()) break;
        estimated_end = std::min(next + batch, untested_.size());
        batch = std::min(2 * batch, kMaxBatchEstimates);
        estimate_untested(next, estimated_end);
      }
      visibility = inputs_.occlusion->find(found.number);
    } else {
      visibility = inputs_.occlusion->test_new(found.number, *found.source, unoccluded_priority,
                                               candidates_[c].share);
      rays_left = visibility != VisibilityCache::kUnknown;
      if (!rays_left) break;
    }
    highest_priorities_.push_back(apply_visibility(c));
    std::push_heap(highest_priorities_.begin(), highest_priorities_.end(), std::greater<>());
    if (highest_priorities_.size() <= inputs_.voices + 1) continue;
    std::pop_heap(highest_priorities_.begin(), highest_priorities_.end(), std::greater<>());
    highest_priorities_.pop_back();
  }
  for (; next < untested_.size(); ++next) candidates_[untested_[next].second].priority = 0;
  return rays_left;
}

// Estimates the visibility of untested_[first, last) on all cores.
void CandidateSet::estimate_untested(std::size_t first, std::size_t last) {
  wanted_.clear();
  for (std::size_t u = first; u < last; ++u) {
    const std::uint32_t c = untested_[u].second;
    Candidate& candidate = candidates_[c];
    candidate.share =
        share_of_sum(band_weights_[c], scale_at_threshold(candidate.weight, source_of(candidate)));
    wanted_.push_back(wanted_of(candidate));
  }
  inputs_.occlusion->estimate_now(wanted_);
}

// Reduces highest_priorities_ to a heap of the k + 1 highest, the lowest of them in front.
void CandidateSet::keep_highest_priorities() {
  auto& heap = highest_priorities_;
  if (heap.size() > inputs_.voices + 1) {
    std::nth_element(heap.begin(), heap.begin() + static_cast<std::ptrdiff_t>(inputs_.voices),
                     heap.end(), std::greater<>());
    heap.resize(inputs_.voices + 1);
  }
  std::make_heap(heap.begin(), heap.end(), std::greater<>());
}

// Applies the visibility to a candidate. Returns its priority. Pools search without occlusion, so
// what an edge adds to a direct sound does not count.
double CandidateSet::apply_visibility(std::uint32_t c) {
  Candidate& candidate = candidates_[c];
  const FoundSource& found = source_of(candidate);
  const Bands& visibility = inputs_.occlusion->visibility(candidate.visibility);
  if (!inputs_.is_exact()) wanted_.push_back(wanted_of(candidate));
  BandSums visible{};
  for (std::size_t b = 0; b < kBandCount; ++b)
    visible[b] = static_cast<double>(band_weights_[c][b]) * std::min(1.0f, visibility[b]);
  const double w = std::accumulate(visible.begin(), visible.end(), 0.0);
  candidate.weight = w;
  candidate.priority = w * candidate.priority_per_weight;
  candidate.is_occlusion_applied = true;
  if (w > 0 && candidate.priority >= threshold_) {
    const double scale = scale_at_threshold(w, found);
    for (std::size_t b = 0; b < kBandCount; ++b) heard_[b] += scale * visible[b];
  }
  return candidate.priority;
}

// Ties go to the lower number, so that the choice is unique.
bool CandidateSet::comes_before(const Candidate& a, const Candidate& b) const {
  return a.priority != b.priority ? a.priority > b.priority
                                  : source_of(a).number < source_of(b).number;
}

double CandidateSet::keep_highest(std::size_t count) {
  ranked_.clear();
  for (std::uint32_t c = 0; c < candidates_.size(); ++c)
    ranked_.push_back({candidates_[c].priority, c});
  const auto last = ranked_.begin() + static_cast<std::ptrdiff_t>(count);
  std::nth_element(ranked_.begin(), last, ranked_.end(), [this](const Ranked& a, const Ranked& b) {
    return a.first != b.first ? a.first > b.first
                              : comes_before(candidates_[a.second], candidates_[b.second]);
  });
  const Candidate next = candidates_[last->second];
  std::erase_if(candidates_, [&](const Candidate& one) { return !comes_before(one, next); });
  candidates_.push_back(next);
  return next.priority;
}

// Pools without instances mostly find sources in this order.
void CandidateSet::sort_by_number(std::size_t count) {
  const auto number = [this](const Candidate& candidate) {
    const FoundSource& found = source_of(candidate);
    return found.voice != 0 ? found.voice : found.number;
  };
  const auto first = std::span(candidates_).first(count);
  if (!std::ranges::is_sorted(first, {}, number)) std::ranges::sort(first, {}, number);
}

}  // namespace clamor
