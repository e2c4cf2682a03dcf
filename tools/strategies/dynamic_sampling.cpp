#include "tools/strategies/dynamic_sampling.h"

#include <algorithm>
#include <cmath>

#include "runtime/voices/keyframe.h"

namespace clamor {

std::span<const DynamicSample::Choice> DynamicSample::next(std::span<const Candidate> candidates) {
  candidates_ = candidates;
  Draws draws(tuning_.seed, keyframes_);
  if (rule_ != Rule::kOnce || keyframes_ == 0) {
    weights_.clear();
    for (const Candidate& candidate : candidates) weights_.push_back(candidate.weight);
    probabilities_ = inclusion_probabilities(weights_, k_);
  }
  const auto redraw =
      static_cast<std::uint64_t>(std::max(1.0, std::round(tuning_.redraw_s / kKeyframe_s)));
  if (keyframes_ == 0 || (rule_ == Rule::kFull && keyframes_ % redraw == 0)) {
    draw_anew();
  } else {
    find_members();
    if (rule_ == Rule::kStochastic) exchange_by_share(draws);
    if (rule_ == Rule::kAdaptive) exchange_by_change(draws);
    if (rule_ == Rule::kStochastic || rule_ == Rule::kAdaptive) fill(draws);
  }
  ++keyframes_;

  const bool of_now = rule_ == Rule::kStochastic || rule_ == Rule::kAdaptive;
  sample_.clear();
  for (const Member& member : members_) {
    const double p = of_now ? probabilities_[member.candidate] : member.probability;
    sample_.push_back({member.candidate, p > 0 ? 1 / p : 0});
  }
  std::sort(sample_.begin(), sample_.end(),
            [](const auto& a, const auto& b) { return a.candidate < b.candidate; });
  return sample_;
}

void DynamicSample::draw_anew() {
  Draws draws(tuning_.seed, keyframes_);
  const std::vector<std::uint32_t> chosen = choose_without_replacement(probabilities_, draws);
  members_.clear();
  for (const std::uint32_t c : chosen)
    members_.push_back({c, candidates_[c].number, weights_[c], probabilities_[c]});
}

// Candidates of an octree's cut may have come and gone; those of a list do not.
void DynamicSample::find_members() {
  std::size_t kept = 0;
  for (Member& member : members_) {
    if (member.candidate >= candidates_.size() ||
        candidates_[member.candidate].number != member.number) {
      const auto found = std::lower_bound(
          candidates_.begin(), candidates_.end(), member.number,
          [](const Candidate& candidate, std::uint64_t n) { return candidate.number < n; });
      if (found == candidates_.end() || found->number != member.number) continue;
      member.candidate = static_cast<std::uint32_t>(found - candidates_.begin());
    }
    members_[kept++] = member;
  }
  members_.resize(kept);
}

void DynamicSample::leave(std::size_t member) {
  members_[member] = members_.back();
  members_.pop_back();
}

// "Chose a small number of q / update_frequency sound sources to be faded out at every keyframe."
// Exchanges one at a time and replaces each before the next leaves. Certain ones never leave.
void DynamicSample::exchange_by_share(Draws& draws) {
  due_ += tuning_.exchange_per_s * kKeyframe_s * static_cast<double>(k_);
  for (; due_ >= 1; due_ -= 1) {
    if (members_.empty()) continue;
    const auto m = static_cast<std::size_t>(draws.next() * static_cast<double>(members_.size()));
    if (probabilities_[members_[m].candidate] >= 1) continue;
    leave(m);
    fill(draws);
  }
}

void DynamicSample::exchange_by_change(Draws& draws) {
  std::size_t grown = 0;
  for (std::size_t m = 0; m < members_.size();) {
    Member& member = members_[m];
    const double now = weights_[member.candidate];
    if (now < member.weight / tuning_.epsilon) {
      leave(m);
      continue;
    }
    if (now > member.weight * tuning_.epsilon) {
      member.weight = now;  // otherwise it would count again at the next keyframe
      ++grown;
    }
    ++m;
  }
  // Certain members do not represent others, and stay.
  for (; grown > 0 && !members_.empty(); --grown) {
    const auto m = static_cast<std::size_t>(draws.next() * static_cast<double>(members_.size()));
    if (probabilities_[members_[m].candidate] < 1) leave(m);
  }
}

// Draws unused candidates by importance until there are k; certain ones come first.
void DynamicSample::fill(Draws& draws) {
  if (members_.size() >= k_) return;
  used_.assign(candidates_.size(), 0);
  for (const Member& member : members_) used_[member.candidate] = 1;
  for (std::uint32_t c = 0; c < candidates_.size() && members_.size() < k_; ++c)
    if (!used_[c] && probabilities_[c] >= 1) enter(c);
  while (members_.size() < k_) {
    odds_to_.resize(candidates_.size());
    double sum = 0;
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      if (!used_[c]) sum += probabilities_[c] / (1 - probabilities_[c]);
      odds_to_[c] = sum;
    }
    if (sum == 0) return;
    // The sums are out of date when one is drawn that has just come in.
    for (bool right = true; right && members_.size() < k_;) {
      const auto above =
          std::upper_bound(odds_to_.begin(), odds_to_.end(), draws.next() * sum) - odds_to_.begin();
      const auto c =
          static_cast<std::uint32_t>(std::min<std::ptrdiff_t>(above, std::ssize(odds_to_) - 1));
      right = !used_[c] && probabilities_[c] > 0;
      if (right) enter(c);
    }
  }
}

void DynamicSample::enter(std::uint32_t c) {
  used_[c] = 1;
  members_.push_back({c, candidates_[c].number, weights_[c], probabilities_[c]});
}

}  // namespace clamor
