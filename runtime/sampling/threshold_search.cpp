#include "runtime/sampling/threshold_search.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace clamor {

namespace {

constexpr double kStep = 16;
// All sources of lower priority together are some 150 dB below full scale or less.
constexpr double kInaudible = 1e-18;
// Ratios of two thresholds between which no other is worth a query, without and with occlusion.
constexpr double kNarrow = 1 + 1e-9, kNarrowWithOcclusion = 1.25;
// Where the number of sources hardly grows as the threshold falls, small steps would go on for
// long.
constexpr int kMaxNearMisses = 2;
constexpr double kFlat = 1.02;        // growth in a step, after which all that is left is taken
constexpr double kCostGrowth = 1.25;  // of a query, relative to the fall of its threshold
constexpr std::size_t kMaxExamined = 100'000;
constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

void ThresholdSearch::restart(bool has_moved) {
  paused_.reset();
  if (has_moved) stopped_waiting_ = false;
  restarted_predictor_ = predictor_;
}

ThresholdSearch::Result ThresholdSearch::run(const SamplingMoment& moment) {
  predictor_ = restarted_predictor_;
  if (!paused_) last_found_ = 0;
  Result result = bound_ == SearchBound::kBounded ? search_within_budget(moment) : search(moment);
  const bool starved = candidates_.size() <= inputs_.voices;
  if (!starved) result.threshold = candidates_.keep_highest(inputs_.voices);
  predictor_.observe(result.threshold > kInaudible ? result.threshold : 0, starved);
  return result;
}

bool ThresholdSearch::waits_for_pages() const {
  return inputs_.is_exact() && inputs_.pool.lacks_pages() && !stopped_waiting_;
}

ThresholdSearch::Result ThresholdSearch::search(const SamplingMoment& moment) {
  Bracket bracket = paused_.value_or(Bracket{.threshold = first_threshold()});
  auto& [threshold, too_high, too_low, is_unlimited, near_misses] = bracket;
  const double narrow = inputs_.occlusion == nullptr ? kNarrow : kNarrowWithOcclusion;
  for (;;) {
    // Many sources share one priority; or, with occlusion, testing so many is worth while.
    is_unlimited = is_unlimited || too_high <= too_low * narrow;
    const bool all =
        candidates_.find(threshold, is_unlimited || inputs_.is_exact() ? kNoLimit : max_found());
    if (all) candidates_.weigh(moment, threshold);
    if (waits_for_pages()) {
      paused_ = bracket;
      return {threshold};
    }
    const bool may_lower = !all || apply_occlusion(threshold);
    const bool ends = all && (is_complete(threshold) || !may_lower);
    if (ends || inputs_.budget.is_stopped()) return {threshold};
    (all ? too_high : too_low) = threshold;
    if (std::isinf(too_high))
      threshold *= kStep;
    else if (too_low > 0 && !is_unlimited)
      threshold = std::sqrt(too_low * too_high);
    else if (predictor_.is_known() &&
             near_misses++ < (2 * candidates_.size() > inputs_.voices ? kMaxNearMisses : 1))
      threshold = lowered_after_miss(threshold);
    else
      threshold = lowered(threshold);
  }
}

// Lowers the threshold as long as the next query is likely to be completed, with enough budget left
// to repeat the last one if it is not. Raises it only if the first guess was far too low.
ThresholdSearch::Result ThresholdSearch::search_within_budget(const SamplingMoment& moment) {
  WorkBudget& budget = inputs_.budget;
  const std::uint64_t whole = work_per_keyframe(inputs_.voices), end = budget.spent() + whole;
  double threshold = first_threshold();
  double completed = kInfinity, too_low = 0;
  int near_misses = 0;
  std::uint64_t completed_cost = 0;  // of the completed query with the lowest threshold
  std::uint64_t allowed = whole / 4 * 3;
  for (;;) {
    const std::uint64_t before = budget.spent();
    budget.limit(allowed);
    const bool all = candidates_.find(threshold, std::isinf(completed) ? max_found() : kNoLimit);
    if (all || !budget.is_stopped()) candidates_.weigh(moment, threshold);
    const bool may_lower = !all || apply_occlusion(threshold);
    if (budget.is_stopped()) return {threshold};
    if (all && (is_complete(threshold) || !may_lower)) return {threshold};
    const std::uint64_t cost = budget.spent() - before;
    const std::uint64_t left = end - std::min(end, budget.spent());
    double next = 0;
    if (all) {
      completed = threshold;
      completed_cost = cost;
      next = predictor_.is_known() && too_low == 0 && 2 * candidates_.size() > inputs_.voices &&
                     near_misses++ < kMaxNearMisses
                 ? lowered_after_miss(threshold)
                 : lowered(threshold);
      if (next <= too_low) next = std::sqrt(too_low * completed);
      // The number of sources above a threshold grows at most as the threshold falls. Where most
      // of them are occluded, lower thresholds gain little, so half the budget is enough.
      const bool mostly_occluded =
          inputs_.occlusion != nullptr && 2 * candidates_.size() < candidates_.reached();
      const std::uint64_t kept = completed_cost + (mostly_occluded ? whole / 2 : 0);
      const double affordable =
          static_cast<double>(left - std::min(left, kept)) /
          (kCostGrowth * static_cast<double>(std::max<std::uint64_t>(cost, 1)));
      const bool is_narrow = completed <= too_low * kNarrowWithOcclusion;
      const bool is_near_miss = threshold <= next * kNarrowWithOcclusion;
      const bool takes_all = next <= kInaudible;  // which is few more
      if (is_narrow ||
          (!takes_all && affordable < (is_near_miss ? threshold / next : kNarrowWithOcclusion)))
        return {threshold, true};
      if (!takes_all) next = std::max(next, threshold / affordable);
      allowed = left - completed_cost;
    } else if (std::isinf(completed)) {
      // This threshold is too low, and no more is known: a far higher one costs little.
      too_low = threshold;
      next = std::max(kStep * threshold, std::sqrt(threshold * inputs_.pool.upper_bound()));
      if (left < whole / 16) return {threshold, true};
      allowed = left / 2;
    } else {
      budget.limit(WorkBudget::kUnlimited);  // its cost is known
      const bool repeated = candidates_.find(completed, kNoLimit);
      if (repeated || !budget.is_stopped()) candidates_.weigh(moment, completed);
      apply_occlusion(completed);
      return {completed, true};
    }
    threshold = next;
  }
}

double ThresholdSearch::first_threshold() const {
  if (inputs_.pool.size() <= inputs_.voices) return 0;  // finds all
  // A search that had to take every source continues with every source.
  if (predictor_.starved() && !predictor_.is_known()) return kInaudible;
  return predictor_.is_known() ? predictor_.next() : inputs_.pool.upper_bound();
}

// The next threshold after a prediction that too few candidates reached.
double ThresholdSearch::lowered_after_miss(double threshold) const {
  return threshold * ThresholdPredictor::lowering_factor(candidates_.size(), inputs_.voices + 1);
}

// The next threshold after one that too few candidates reached.
double ThresholdSearch::lowered(double threshold) {
  const double previously_found =
      std::exchange(last_found_, static_cast<double>(candidates_.found_count()));
  if (inputs_.occlusion == nullptr || candidates_.found_count() == 0)
    return std::max(threshold / kStep, kInaudible);
  double step = kMaxOcclusionStep;
  if (inputs_.is_exact()) {
    // The visibility of everything that is found is estimated, so it must not be far more than
    // needed. The number of sources grows with a power of the step, at most the first.
    const double growth = static_cast<double>(max_examined()) / last_found_;
    const double power = previously_found > 0
                             ? 1.5 * std::log(last_found_ / previously_found) / std::log(last_step_)
                             : 1;
    step = std::pow(std::clamp(growth, kNarrowWithOcclusion, kMaxOcclusionStep),
                    1 / std::clamp(power, 0.4, 1.0));
  } else if (last_found_ < kFlat * previously_found) {
    return kInaudible;
  }
  last_step_ = step;
  return std::max(threshold / step, kInaudible);
}

// Whether there are k + 1 candidates, or none left to find.
bool ThresholdSearch::is_complete(double threshold) const {
  return candidates_.size() > inputs_.voices || threshold <= kInaudible;
}

// False if a lower threshold is of no use: no rays are left, or enough sources were found.
bool ThresholdSearch::apply_occlusion(double threshold) {
  if (inputs_.occlusion == nullptr) return true;
  const bool rays_left = candidates_.apply_occlusion(threshold);
  return rays_left &&
         candidates_.found_count() <= (inputs_.is_exact() ? max_examined() : max_found() / 2);
}

// A second query is cheaper than weighing more sources than these. With varying signals most of
// those found by the maximum of their signal are too quiet now.
std::size_t ThresholdSearch::max_found() const {
  return (16 * inputs_.voices + 4096) * (inputs_.weights.steady() ? 1 : 16);
}

// An exact search ends once it has found so many sources.
std::size_t ThresholdSearch::max_examined() const { return kMaxExamined + 16 * inputs_.voices; }

}  // namespace clamor
