// planned_query.cpp: how OctreePool goes through a plan, a third of it in each keyframe.
//
// A plan has a thousand nodes, whose lists lie far apart in memory, and a keyframe later nearly the
// same sources of them matter. So nodes side by side make parts, which take turns: one that is
// asked is asked for all places where the listener will be until its next turn, going on as now,
// until then, and for somewhat lower thresholds. What it finds is kept; a keyframe takes what is
// loud enough of that. A part that does not hold any more (one turns, hurries, a door opens) is
// asked out of turn. So nothing is missed, whatever one does; and who jumps about pays for it.
//
// Of what stands in the way, what was known when a part was asked counts until its next turn.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "runtime/query/octree_pool.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

namespace {

constexpr double kMostStep_m = 0.25;   // of a keyframe; who is faster sees other sources each time
constexpr double kAsideOfStep = 0.25;  // of a step, that the next ones may be longer or turn
constexpr double kStandStill_m = 1e-4;
constexpr double kLowerAhead = 0.93;  // than the threshold
constexpr double kNodeGive_m = 0.25;  // that a node which is too quiet is not asked again for
constexpr std::size_t kRenewedAhead = 2, kPlannedAhead = 16;

}  // namespace

bool OctreePool::look_by_plan(const Vec3& place, double threshold, std::size_t most,
                              std::vector<FoundSource>& found) {
  copies_ = plan_.copies;
  for (Copy& copy : copies_) copy.place = place;
  const bool renumbered = plan_.lists != shortlists_.numbering();
  plan_.lists = shortlists_.numbering();
  if (renumbered)
    for (Plan::Node& node : plan_.nodes)
      if (node.page != nullptr) node.list = shortlists_.number_of(node.step.first);
  if (!on_.shortlists) return look_without_lists(threshold, most, found);
  const Scope scope = scope_of(place, threshold);
  find_parts_to_ask(place, threshold, scope);
  find_lists_to_renew(threshold, scope);
  if (!renew_lists(scope) || !ask_parts(scope, most)) return give_up_parts();
  for (const Plan::Part& part : plan_.parts) {
    const std::size_t before = found.size();
    take_heard(part, threshold, found);
    spend(part.heard.size() + WorkBudget::kFound * (found.size() - before));
    if (found.size() > most || is_exhausted()) return false;
  }
  looked_for_ = threshold;
  return true;
}

// What parts are asked for: a ball round the way from here to where they have their next turn.
Scope OctreePool::scope_of(const Vec3& place, double threshold) const {
  const double step_m = length(step_m_);
  if (turns_ahead_ == 0 || step_m > kMostStep_m) return {place, 0, threshold, time_s_};
  const double half = turns_ahead_ / 2.0;
  return {place + half * step_m_, (half + kAsideOfStep) * step_m + kStandStill_m,
          kLowerAhead * threshold, time_s_ + ahead_s_};
}

// Those whose turn it is, and those that do not hold: as none does where everything has changed.
void OctreePool::find_parts_to_ask(const Vec3& place, double threshold, const Scope& scope) {
  const bool all = turns_ahead_ == 0 || (hidden_ != nullptr && hidden_->retests_all());
  asked_parts_.clear();
  for (std::uint32_t p = 0; p < plan_.parts.size(); ++p) {
    Plan::Part& part = plan_.parts[p];
    const bool is_in_turn = all || (part.block + keyframe_) % kTurns == 0;
    if ((part.keyframe == keyframe_ || !is_in_turn) &&
        part.scope.holds({place, 0, threshold, time_s_}))
      continue;
    part.scope = scope;
    part.keyframe = keyframe_;
    part.heard.clear();
    asked_parts_.push_back(p);
  }
}

// Of asked parts, those that do not hold, of nodes that matter; and notes what is missing of these.
// A node of which nothing matters is not asked again for a while.
void OctreePool::find_lists_to_renew(double threshold, const Scope& scope) {
  due_.clear();
  const Vec3f scope_m(scope.place - plan_.place);
  for (const std::uint32_t p : asked_parts_) {
    const Plan::Part& part = plan_.parts[p];
    for (std::uint32_t n = part.first; n < part.last; ++n)
      if (!plan_.asked[n].holds(scope, scope_m)) due_.push_back({n, p});
  }
  spend(WorkBudget::kPlannedNode * due_.size());
  renewed_.clear();
  Copy there{};
  there.place = scope.place;
  for (std::size_t d = 0; d < due_.size(); ++d) {
    if (d + 2 * kPlannedAhead < due_.size())
      prefetch_to_read(&plan_.nodes[due_[d + 2 * kPlannedAhead].node], sizeof(Plan::Node));
    if (d + kPlannedAhead < due_.size()) {
      const Plan::Node& soon = plan_.nodes[due_[d + kPlannedAhead].node];
      if (soon.page != nullptr) shortlists_.prefetch(soon.list);
      prefetch_to_read(soon.step.entry, sizeof(PageEntry));
    }
    const auto [n, p] = due_[d];
    const Plan::Node& node = plan_.nodes[n];
    Plan::Answer& asked = plan_.asked[n];
    const auto is_quiet = [&](double give_m, double above) {
      asked = {{scope.place, give_m, above, until_s_}, plan_.place, true};
    };
    asked = {};
    if (node.widest < scope.threshold) {
      is_quiet(std::numeric_limits<double>::infinity(), node.widest);
      asked.by_plan = true;
      continue;
    }
    if (node.page == nullptr || !shortlists_.holds(node.list, scope)) {
      const PageEntry& entry = *node.step.entry;
      const double highest = bound(entry, there, entry.highest_key, scope.give_m);
      if (!(highest > 0 && highest >= scope.threshold)) {
        is_quiet(kNodeGive_m, bound(entry, there, entry.highest_key, kNodeGive_m));
        continue;
      }
      if (node.page == nullptr) {
        note_planned_missing(due_[d], highest, threshold);
        continue;
      }
    }
    renewed_.push_back({n, p});
  }
}

// One whose page is not here, that matters now or somewhere in a scope. Its part holds only for
// thresholds above that: until it comes, it is asked again in each keyframe.
void OctreePool::note_planned_missing(const PlannedNode& one, double highest, double threshold) {
  const Step& step = plan_.nodes[one.node].step;
  double& least = plan_.parts[one.part].scope.threshold;
  least = std::max(least, highest * (1 + 1e-6));
  const double now = bound(*step.entry, copies_[step.copy], step.entry->highest_key);
  if (now > 0 && now >= threshold) {
    loader_.use(*step.entry, now);  // counts it as late
    note_missing(step, now, 1);
  } else if (highest >= threshold && !loader_.has_failed(*step.entry)) {
    nearly_.push_back({highest, *step.entry, false});
  }
}

// Parts that were begun have to be asked again, whatever is asked next.
bool OctreePool::give_up_parts() {
  for (const std::uint32_t p : asked_parts_) {
    plan_.parts[p].scope.give_m = -1;
    plan_.parts[p].heard.clear();
  }
  return false;
}

// False if the budget is exhausted.
bool OctreePool::renew_lists(const Scope& scope) {
  const Vec3f scope_m(scope.place - plan_.place);
  const auto page_of = [this](std::size_t r) { return plan_.nodes[renewed_[r].node].page; };
  for (std::size_t r = 0; r < renewed_.size(); ++r) {
    if (r + 4 * kRenewedAhead < renewed_.size())
      __builtin_prefetch(&page_of(r + 4 * kRenewedAhead)->sources);
    if (r + 2 * kRenewedAhead < renewed_.size()) {
      page_of(r + 2 * kRenewedAhead)->sources.prefetch_cullers();
      shortlists_.prefetch_kept(plan_.nodes[renewed_[r + 2 * kRenewedAhead].node].list);
    }
    if (r + kRenewedAhead < renewed_.size()) page_of(r + kRenewedAhead)->sources.prefetch();
    const auto [n, p] = renewed_[r];
    const Plan::Node& node = plan_.nodes[n];
    shortlists_.renew(
        node.list, {node.page->sources, *node.step.entry, node.step.first, scope, nullptr, maps_},
        looked_at_);
    plan_.asked[n] = {shortlists_.held(node.list), plan_.place, shortlists_.is_empty(node.list)};
    // Who hurries has lists that hold here and nowhere else.
    if (!plan_.asked[n].holds(scope, scope_m)) plan_.parts[p].scope.give_m = -1;
    ++visited_;
    spend(WorkBudget::kNode);
    if (is_exhausted()) return false;
  }
  return true;
}

// Fills what asked parts have heard. False if that is more than so many, or the budget is
// exhausted.
bool OctreePool::ask_parts(const Scope& scope, std::size_t most) {
  heard_.clear();
  for (const std::uint32_t p : asked_parts_) {
    const Plan::Part& part = plan_.parts[p];
    for (std::uint32_t n = part.first; n < part.last; ++n)
      if (!plan_.asked[n].empty) heard_.push_back({n, p});
  }
  const auto node_of = [this](std::size_t h) -> const Plan::Node& {
    return plan_.nodes[heard_[h].node];
  };
  std::size_t passed = 0;
  for (std::size_t h = 0; h < heard_.size(); ++h) {
    if (h + 2 * kPlannedAhead < heard_.size())
      prefetch_to_read(&node_of(h + 2 * kPlannedAhead), sizeof(Plan::Node));
    if (h + kPlannedAhead < heard_.size()) {
      const Plan::Node& soon = node_of(h + kPlannedAhead);
      shortlists_.prefetch(soon.list);
      __builtin_prefetch(soon.kept, 1);
    }
    const Plan::Node& node = node_of(h);
    shortlists_.use(node.list, looked_at_);
    loader_.use(*node.kept, node.step.most, turns_ahead_);
    met_.push_back({node.step, node.sources, node.list, scope.threshold, false, heard_[h].part});
    if (met_.size() < kMostMet && h + 1 < heard_.size()) continue;
    passed += pass_planned(scope);
    if (passed > most || is_exhausted()) return false;
  }
  return true;
}

// Gives how many sources are heard of the pages that were met.
std::size_t OctreePool::pass_planned(const Scope& scope) {
  asked_lists_.clear();
  for (const Met& met : met_)
    asked_lists_.push_back({met.list, scope.place, scope.threshold, scope.give_m});
  std::size_t passed = 0;
  const Met* last = nullptr;
  shortlists_.pass(asked_lists_, [&](const PageShortlists::Passed& one) {
    const Met& met = met_[one.asked];
    if (&met != last) {
      ++visited_;
      spend(WorkBudget::kNode);
    }
    last = &met;
    const BoostedBound boosted(one.boost, strength_, one.ceiling);
    if (boosted.ceiling < scope.threshold) return;
    const Source* const source = met.sources + one.index;
    SourcePage::prefetch(*source);  // to be weighed
    const auto ceiling = static_cast<float>(boosted.ceiling * (1 + 1e-6));
    plan_.parts[met.part].heard.push_back({source, met.step.first + one.index, one.signal,
                                           met.step.copy, boosted.boost, ceiling,
                                           ceiling * one.share, one.known});
    ++passed;
  });
  met_.clear();
  return passed;
}

void OctreePool::take_heard(const Plan::Part& part, double threshold,
                            std::vector<FoundSource>& found) const {
  for (const Plan::Heard& one : part.heard)
    if (!is_too_quiet(static_cast<double>(one.loud), one.known, one.number, threshold))
      found.push_back({one.source, one.number, one.signal, one.copy, one.boost,
                       static_cast<double>(one.ceiling)});
}

}  // namespace clamor
