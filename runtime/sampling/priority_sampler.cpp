// priority_sampler.cpp: the k sources of highest priority.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "runtime/propagation/source_weight.h"
#include "runtime/sampling/sampler.h"
#include "runtime/sampling/threshold_predictor.h"

namespace clamor {

namespace {

class Priority final : public Sampler {
 public:
  Priority(const RadiationModel& field, SignalWeights weights, SourcePool& pool, std::size_t voices,
           VisibilityCache* occlusion, SearchBound bound)
      : field_(field),
        weights_(std::move(weights)),
        pool_(pool),
        most_voices_(voices),
        voices_(voices),
        occlusion_(occlusion),
        bounded_(bound == SearchBound::kBounded) {
    pool_.charge(&budget_);
    pool_.set_late_boost(LateBoost::strength(voices));
  }
  ~Priority() override { pool_.charge(nullptr); }
  Priority(const Priority&) = delete;
  Priority& operator=(const Priority&) = delete;

  // The sample depends on the place, the time and the pages in memory alone. With steady signals a
  // listener who stands still costs nothing once the occlusion of all candidates is known.
  //
  // An exact sampler waits for pages and is called again whenever some have arrived. So that the
  // sample does not depend on when they do, no visibility is estimated before all pages that reach
  // the threshold are in memory, and a repeated call continues the search.
  std::span<const SampledSource> sample(const Listener& listener, double time_s) override {
    const Vec3& place = listener.position_m;
    const bool turned = faced_ != reception();
    const bool elsewhere = place_ != place || turned || (!weights_.steady() && time_s_ != time_s);
    const bool again = exact() && !elsewhere && !resized_;
    if (!pool_.refresh() && !elsewhere && !resized_ && !(exact() ? waited_ : looking_))
      return sample_;
    if (!again) {
      paused_.reset();
      resized_ = false;
      if (place_ != place) gave_up_waiting_ = false;
      before_ = predictor_;
    }
    predictor_ = before_;
    place_ = place;
    faced_ = reception();
    time_s_ = time_s;
    // An exact sampler estimates visibilities anew for this place.
    pool_.set_occlusion_bounds(
        occlusion_ != nullptr && !exact() ? &occlusion_->upper_bounds() : nullptr);
    pool_.begin(place, time_s);
    if (occlusion_ != nullptr && !again) occlusion_->begin_keyframe(place);
    const double tau = choose(place);
    sample_.clear();
    for (std::size_t c = 0; c < std::min(voices_, candidates_.size()); ++c) {
      const Candidate& chosen = candidates_[c];
      const FoundSource& found = found_[chosen.found];
      const Source& source = *found.source;
      double scale = std::max(1.0, tau / (chosen.weight * found.boost));
      if (const double kappa = pool_.unseen_key(found, tau); kappa > 0)
        scale =
            std::max(scale, kappa / std::accumulate(source.power.begin(), source.power.end(), 0.0));
      sample_.push_back({found.number, scale, &source, found.signal,
                         chosen.is_dimmed ? occlusion_->visibility(chosen.known) : kAllHeard,
                         chosen.priority > 0 ? std::min(1.0, tau / chosen.priority) : 1.0});
      if (found.voice != 0) sample_.back().set_moving(found);
    }
    // Pools without instances mostly find sources in this order.
    const auto by_number = [](const auto& a, const auto& b) { return a.number < b.number; };
    if (!std::is_sorted(sample_.begin(), sample_.end(), by_number))
      std::sort(sample_.begin(), sample_.end(), by_number);
    if (bounded_) budget_.limit(work_ahead_per_keyframe(voices_));
    pool_.ask(place + kPrefetchAhead_s * listener.velocity_mps, tau);
    waited_ = waits();
    const bool learns = occlusion_ != nullptr && !exact() && occlusion_->refresh(wanted_, tau);
    looking_ = learns || ended_by_budget_;
    return sample_;
  }

  bool complete() override {
    const bool here = pool_.complete();
    if (!here || !waits()) return here;
    gave_up_waiting_ = true;  // what is missing does not arrive: choose from what is in memory
    return false;
  }

  std::size_t capacity() const override {
    return static_cast<std::size_t>(std::min<std::uint64_t>(most_voices_, pool_.size()));
  }

  void stop_when(const std::atomic<bool>* stop) override { budget_.stop_when(stop); }

  std::uint64_t work() const override { return budget_.spent(); }
  std::uint64_t bounded_keyframes() const override { return bounded_keyframes_; }

  void set_voice_count(std::size_t voices) override {
    voices = std::clamp<std::size_t>(voices, 1, most_voices_);
    if (voices == voices_) return;
    predictor_.want(voices_, voices);
    voices_ = voices;
    pool_.set_late_boost(LateBoost::strength(voices));
    resized_ = true;
  }

 private:
  static constexpr double kPrefetchAhead_s = 0.5;
  static constexpr double kStep = 16, kStepWhereHidden = 4;
  // All sources of lower priority together are some 150 dB below full scale or less.
  static constexpr double kInaudible = 1e-18;
  static constexpr double kNarrow = 1 + 1e-9, kNarrowEnough = 1.25;
  static constexpr double kGrowth = 1.25;  // of the cost of a query when its threshold falls
  static constexpr std::size_t kMaxExamined = 100'000;
  // Visibilities that an exact search estimates together, at first and at most.
  static constexpr std::size_t kFirstLooks = 256, kMostLooks = 8192;
  static constexpr std::size_t kFetchAhead = 24, kTogether = 32;
  static constexpr Bands kAllHeard = same_in_all_bands(1);
  static constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

  struct Candidate {
    double priority, weight;
    double per_weight;    // priority over weight
    std::uint32_t found;  // index into found_
    VisibilityCache::Index known = VisibilityCache::kUnknown;
    bool is_dimmed = false;  // its occlusion is accounted for
  };
  // Ties go to the lower number, so that the choice is unique.
  bool comes_before(const Candidate& a, const Candidate& b) const {
    return a.priority != b.priority ? a.priority > b.priority
                                    : found_[a.found].number < found_[b.found].number;
  }

  bool exact() const { return occlusion_ != nullptr && occlusion_->exact(); }

  // Fills candidates_ with the k + 1 highest priorities, the lowest last, and returns that one; or
  // with fewer, if fewer reach the threshold that is returned.
  double choose(const Vec3& place) {
    const Search found = bounded_ ? search_within_budget(place) : search(place);
    ended_by_budget_ = found.ended_by_budget;
    bounded_keyframes_ += found.ended_by_budget;
    const bool starved = candidates_.size() <= voices_;
    const double threshold = starved ? found.threshold : keep_the_first();
    predictor_.was(threshold > kInaudible ? threshold : 0, starved);
    return threshold;
  }

  struct Search {
    double threshold = 0;
    bool ended_by_budget = false;
  };

  // The lowest threshold tried with too few sources, and the highest with far too many.
  struct Bracket {
    double threshold = 0;
    double too_high = std::numeric_limits<double>::infinity(), too_low = 0;
    bool unlimited = false;
    int just_missed = 0;
  };

  double first_threshold(const Vec3& place) {
    if (pool_.size() <= voices_) return 0;  // finds all
    return predictor_.is_known() ? predictor_.next() : pool_.highest(place);
  }

  // The next threshold after one at which too few sources were found.
  double lowered(double threshold) {
    const double before = std::exchange(last_found_, static_cast<double>(found_.size()));
    if (occlusion_ == nullptr || found_.empty()) return std::max(threshold / kStep, kInaudible);
    double step = kStepWhereHidden;
    if (exact()) {
      // The visibility of everything that is found is estimated, so it must not be far more than
      // needed. The number of sources grows with a power of the step, at most the first.
      const double times = static_cast<double>(max_examined()) / last_found_;
      const double power =
          before > 0 ? 1.5 * std::log(last_found_ / before) / std::log(last_step_) : 1;
      step = std::pow(std::clamp(times, kNarrowEnough, kStepWhereHidden),
                      1 / std::clamp(power, 0.4, 1.0));
    }
    last_step_ = step;
    return std::max(threshold / step, kInaudible);
  }

  Search search(const Vec3& place) {
    Bracket now = paused_.value_or(Bracket{.threshold = first_threshold(place)});
    auto& [threshold, too_high, too_low, unlimited, just_missed] = now;
    if (!paused_) last_found_ = 0;
    // A search that had to take every source continues with every source.
    if (exact() && !paused_ && predictor_.starved() && !predictor_.is_known())
      threshold = kInaudible;
    const double close = occlusion_ == nullptr ? kNarrow : kNarrowEnough;
    for (;;) {
      // Many sources share one priority; or, with occlusion, testing so many is worth while.
      unlimited = unlimited || too_high <= too_low * close;
      const bool all = weigh_above(place, threshold, unlimited || exact() ? kNoLimit : limit());
      if (waits()) {
        paused_ = now;
        return {threshold};
      }
      const bool go_on = !all || occlusion_ == nullptr || look_at_candidates(threshold);
      const bool is_lowest = candidates_.size() > voices_ || threshold <= kInaudible;
      const bool enough = all && (is_lowest || !go_on);
      if (enough || budget_.is_stopped()) return {threshold};
      (all ? too_high : too_low) = threshold;
      if (std::isinf(too_high))
        threshold *= kStep;
      else if (too_low > 0 && !unlimited)
        threshold = std::sqrt(too_low * too_high);
      else if (predictor_.is_known() && just_missed++ < (2 * candidates_.size() > voices_ ? 2 : 1))
        threshold *= ThresholdPredictor::lowered(candidates_.size(), voices_ + 1);
      else
        threshold = lowered(threshold);
    }
  }

  // Lowers the threshold as long as the next query is likely to be completed, with enough budget
  // left to repeat the last one if it is not. Raises it only if the first guess was far too low.
  Search search_within_budget(const Vec3& place) {
    const std::uint64_t whole = work_per_keyframe(voices_), end = budget_.spent() + whole;
    double threshold = first_threshold(place);
    double completed = std::numeric_limits<double>::infinity(), too_low = 0;
    std::uint64_t completed_cost = 0;  // of the completed query with the lowest threshold
    std::uint64_t allowed = whole / 4 * 3;
    for (;;) {
      const std::uint64_t before = budget_.spent();
      budget_.limit(allowed);
      const bool all = weigh_above(place, threshold, std::isinf(completed) ? limit() : kNoLimit);
      const bool go_on = !all || occlusion_ == nullptr || look_at_candidates(threshold);
      if (budget_.is_stopped()) return {threshold};
      const bool is_lowest = candidates_.size() > voices_ || threshold <= kInaudible;
      if (all && (is_lowest || !go_on)) return {threshold};
      const std::uint64_t cost = budget_.spent() - before;
      const std::uint64_t left = end - std::min(end, budget_.spent());
      double next = 0;
      if (all) {
        completed = threshold;
        completed_cost = cost;
        next = predictor_.is_known() && too_low == 0 && 2 * candidates_.size() > voices_
                   ? threshold * ThresholdPredictor::lowered(candidates_.size(), voices_ + 1)
                   : lowered(threshold);
        if (next <= too_low) next = std::sqrt(too_low * completed);
        // The number of sources above a threshold grows at most as the threshold falls. Where most
        // of them are occluded, lower thresholds gain little, so half the budget is enough.
        const bool mostly_hidden = occlusion_ != nullptr && 2 * candidates_.size() < voices_;
        const std::uint64_t kept = completed_cost + (mostly_hidden ? whole / 2 : 0);
        const double affordable = static_cast<double>(left - std::min(left, kept)) /
                                  (kGrowth * static_cast<double>(std::max<std::uint64_t>(cost, 1)));
        const bool is_narrow = completed <= too_low * kNarrowEnough;
        const bool just_misses = threshold <= next * kNarrowEnough;
        if (is_narrow || affordable < (just_misses ? threshold / next : kNarrowEnough))
          return {threshold, true};
        next = std::max(next, threshold / affordable);
        allowed = left - completed_cost;
      } else if (std::isinf(completed)) {
        // This threshold is too low, and no more is known: a far higher one costs little.
        too_low = threshold;
        next = std::max(kStep * threshold, std::sqrt(threshold * pool_.highest(place)));
        if (left < whole / 16) return {threshold, true};
        allowed = left / 2;
      } else {
        budget_.limit(WorkBudget::kUnlimited);  // its cost is known
        weigh_above(place, completed, kNoLimit);
        if (occlusion_ != nullptr) look_at_candidates(completed);
        return {completed, true};
      }
      threshold = next;
    }
  }

  // Keeps the k highest candidates in their order, then the next one, whose priority is returned.
  double keep_the_first() {
    ranks_.clear();
    for (std::uint32_t c = 0; c < candidates_.size(); ++c)
      ranks_.push_back({candidates_[c].priority, c});
    const auto last = ranks_.begin() + static_cast<std::ptrdiff_t>(voices_);
    std::nth_element(ranks_.begin(), last, ranks_.end(), [this](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first
                                : comes_before(candidates_[a.second], candidates_[b.second]);
    });
    const Candidate next = candidates_[last->second];
    std::erase_if(candidates_, [&](const Candidate& one) { return !comes_before(one, next); });
    candidates_.push_back(next);
    return next.priority;
  }

  // An exact search ends once so many sources were found.
  std::size_t max_examined() const { return kMaxExamined + 16 * voices_; }

  // A second query is cheaper than weighing more sources than these. With varying signals most of
  // those found by the maximum of their signal are too quiet now.
  std::size_t limit() const { return (16 * voices_ + 4096) * (weights_.steady() ? 1 : 16); }

  // Makes candidates of all sources whose priority is positive and at least `threshold`. False, with
  // some of them, if the pool finds more than `most` or if the budget is exhausted.
  bool weigh_above(const Vec3& place, double threshold, std::size_t most) {
    candidates_.clear();
    parts_.clear();
    found_.clear();
    wanted_.clear();
    const bool all = pool_.look(place, threshold, most, found_);
    if (!all && (!bounded_ || budget_.is_stopped())) return false;
    for (std::size_t first = 0; first < found_.size(); first += kTogether) {
      const std::size_t end = std::min(first + kTogether, found_.size());
      // The sources are far apart in memory.
      for (std::size_t f = end; f < std::min(end + kTogether, found_.size()); ++f) {
        const Source* const soon = found_[f].source;
        __builtin_prefetch(soon);
        __builtin_prefetch(&soon->power);
        if (occlusion_ != nullptr) occlusion_->prefetch(found_[f].number);
      }
      some_.clear();
      for (std::size_t f = first; f < end; ++f) some_.push_back(found_[f].source);
      received_.resize(some_.size());
      field_.receive(some_, place, received_.data());
      for (std::size_t f = first; f < end; ++f) weigh(f, received_[f - first], place, threshold);
    }
    return all;
  }

  static bool is_hidden(VisibilityCache::Index known) {
    return known != VisibilityCache::kUnknown && VisibilityCache::is_occluded(known);
  }

  // Makes a candidate of a source if it reaches the threshold.
  void weigh(std::size_t f, const ReceivedIntensity& received, const Vec3& place,
             double threshold) {
    const FoundSource& found = found_[f];
    const Source& source = *found.source;
    const LoudnessTrack::Moment now =
        weights_at_distance(field_, weights_, found.signal, source, received.way_m, time_s_);
    if (found.upper_bound * now.share < threshold) return;
    const Bands intensity = apply_reception(faced_, source, place, received.intensity);
    const double w = weighted_sum(now.weights, intensity);
    const double per_weight = static_cast<double>(found.boost) / std::max(source.u, kMinU);
    const double priority = w * per_weight;
    if (!(w > 0 && priority >= threshold)) return;
    auto known = VisibilityCache::kUnknown;
    if (exact())
      known = occlusion_->find_current(found.number, source);
    else if (occlusion_ != nullptr)
      known = occlusion_->find(found.number);
    if (is_hidden(known)) {
      // Which occluded sources the pool finds depends on the phase of their bounds.
      if (!exact()) wanted_.push_back({priority, found.number, known, &source});
      return;
    }
    candidates_.push_back({priority, w, per_weight, static_cast<std::uint32_t>(f), known});
    if (occlusion_ != nullptr) parts_.push_back(weighted(now.weights, intensity));
  }

  // Applies the occlusion to as many candidates, loudest first, as decide which are the k + 1
  // highest, and drops those below the threshold. False if weaker ones are of no use: there are no
  // rays left, or enough candidates.
  bool look_at_candidates(double threshold) {
    const bool enough = found_.size() > (exact() ? max_examined() : limit() / 2);
    unknown_.clear();
    best_.clear();
    for (std::uint32_t c = 0; c < candidates_.size(); ++c) {
      const Candidate& candidate = candidates_[c];
      if (const auto ahead = c + kFetchAhead; ahead < candidates_.size())
        if (candidates_[ahead].known != VisibilityCache::kUnknown)
          occlusion_->prefetch_visibility(candidates_[ahead].known);
      if (candidate.known != VisibilityCache::kUnknown)
        best_.push_back(dim(c, candidate.priority));
      else
        unknown_.push_back({candidate.priority, c});
    }
    std::sort(unknown_.begin(), unknown_.end(), std::greater<>());
    if (!unknown_.empty()) keep_best();
    bool rays_left = true;
    std::size_t u = 0;
    std::size_t looked = 0, together = kFirstLooks;  // of unknown_, in an exact search
    for (; u < unknown_.size() && rays_left; ++u) {
      const auto [as_if_free, c] = unknown_[u];
      if (best_.size() > voices_ && best_.front() > as_if_free) break;
      const FoundSource& found = found_[candidates_[c].found];
      if (exact()) {
        if (u == looked) {
          if (budget_.is_stopped()) break;
          looked = std::min(u + together, unknown_.size());
          together = std::min(2 * together, kMostLooks);
          estimate_now(u, looked);
        }
        candidates_[c].known = occlusion_->find(found.number);
      } else {
        candidates_[c].known = occlusion_->test_new(found.number, *found.source, as_if_free);
        rays_left = candidates_[c].known != VisibilityCache::kUnknown;
        if (!rays_left) break;
      }
      best_.push_back(dim(c, as_if_free));
      std::push_heap(best_.begin(), best_.end(), std::greater<>());
      if (best_.size() <= voices_ + 1) continue;
      std::pop_heap(best_.begin(), best_.end(), std::greater<>());
      best_.pop_back();
    }
    for (; u < unknown_.size(); ++u) candidates_[unknown_[u].second].priority = 0;
    std::erase_if(candidates_, [threshold](const Candidate& candidate) {
      return !(candidate.weight > 0 && candidate.priority >= threshold && candidate.priority > 0);
    });
    return rays_left && !enough;
  }

  // Estimates the visibility of unknown_[first, last) on all cores.
  void estimate_now(std::size_t first, std::size_t last) {
    wanted_.clear();
    for (std::size_t u = first; u < last; ++u) {
      const FoundSource& found = found_[candidates_[unknown_[u].second].found];
      wanted_.push_back({.number = found.number, .source = found.source});
    }
    occlusion_->estimate_now(wanted_);
  }

  // Reduces best_ to a heap of its k + 1 highest, the lowest of them in front.
  void keep_best() {
    if (best_.size() > voices_ + 1) {
      std::nth_element(best_.begin(), best_.begin() + static_cast<std::ptrdiff_t>(voices_),
                       best_.end(), std::greater<>());
      best_.resize(voices_ + 1);
    }
    std::make_heap(best_.begin(), best_.end(), std::greater<>());
  }

  // Applies the visibility to a candidate. Returns its priority.
  double dim(std::uint32_t c, double as_if_free) {
    Candidate& candidate = candidates_[c];
    const FoundSource& found = found_[candidate.found];
    const Bands& visibility = occlusion_->visibility(candidate.known);
    if (!exact()) wanted_.push_back({as_if_free, found.number, candidate.known, found.source});
    double w = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      w += static_cast<double>(parts_[c][b]) * visibility[b];
    candidate.weight = w;
    candidate.priority = w * candidate.per_weight;
    candidate.is_dimmed = true;
    return candidate.priority;
  }

  // An exact search estimates visibilities only once no page is missing, so that the sample does not
  // depend on when pages arrive.
  bool waits() const {
    return occlusion_ != nullptr && occlusion_->exact() && pool_.missed() && !gave_up_waiting_;
  }

  const RadiationModel& field_;
  const SignalWeights weights_;
  SourcePool& pool_;
  const std::size_t most_voices_;
  std::size_t voices_;
  bool resized_ = false;  // the number of voices, since sample_
  VisibilityCache* const occlusion_;
  const bool bounded_;
  WorkBudget budget_;
  bool ended_by_budget_ = false;  // the search for sample_
  std::uint64_t bounded_keyframes_ = 0;
  std::optional<Bracket> paused_;          // a search that waits for pages
  ThresholdPredictor predictor_, before_;  // before_: at the first call for this sample
  std::vector<FoundSource> found_;
  std::vector<const Source*> some_;  // up to kTogether
  std::vector<ReceivedIntensity> received_;
  std::vector<Candidate> candidates_;
  std::vector<Bands> parts_;  // weights of the candidates per band, without occlusion
  std::vector<std::pair<double, std::uint32_t>> unknown_;
  std::vector<double> best_;
  std::vector<VisibilityCache::Wanted> wanted_;
  std::vector<std::pair<double, std::uint32_t>> ranks_;
  bool looking_ = false, gave_up_waiting_ = false;
  bool waited_ = false;        // for pages
  std::optional<Vec3> place_;  // of sample_
  Reception faced_;            // in sample_
  double time_s_ = 0;
  double last_found_ = 0, last_step_ = kStepWhereHidden;  // of lowered()
  std::vector<SampledSource> sample_;
};

}  // namespace

std::unique_ptr<Sampler> make_priority_sampler(const RadiationModel& field, SignalWeights weights,
                                               SourcePool& pool, std::size_t voices,
                                               VisibilityCache* occlusion, SearchBound bound) {
  return std::make_unique<Priority>(field, std::move(weights), pool, voices, occlusion, bound);
}

}  // namespace clamor
