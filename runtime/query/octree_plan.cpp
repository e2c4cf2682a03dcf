// octree_plan.cpp: how OctreePool does without a walk in most keyframes.
//
// A walk costs a microsecond per node, of which there are thousands where lobes are sharp, and a
// keyframe later it would come by nearly the same. So the next walk is begun early, for all places
// within a ball that reaches as far ahead as pages are asked for, and done part by part, one with
// each keyframe; what it finds is a plan: nodes, one after the other. As long as it holds, a
// keyframe goes through that (planned_query.cpp), and leaves out nodes whose list is empty or whose
// bound is too low.
//
// Pages that come are taken in. Pages that go end it, as does whatever changes bounds; and where
// they go for want of memory, none is made for a while: it would ask for more than fits again.
// Levels with copies have none: what is found in copies is placed anew in each keyframe anyway.
#include <algorithm>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "runtime/query/octree_pool.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

namespace {

constexpr double kPlanReach = 5;  // of the way to where pages are asked for, of half of it
constexpr double kLeastReach_m = 0.3;
constexpr double kMostReach_m = 3;
constexpr double kLower = 0.6;            // than the lowest threshold of late
constexpr double kFalls = 0.8;            // a threshold, before the next plan is made
constexpr double kPlanHold_s = 0.3;       // a new one must hold for at least that
constexpr double kPlanRounding_m = 1e-4;  // places seen from the middle of a plan
constexpr std::uint32_t kAsksPerLookAhead = 4;
constexpr std::size_t kPagesAhead = 2;
constexpr std::uint32_t kRest_keyframes = 100;
constexpr std::size_t kLeastSteps = 256, kParts = 8, kMostPlanned = 1 << 18;

// Of nodes by ascending numbers.
template <class Nodes>
auto first_from(Nodes& nodes, std::uint64_t number) {
  return std::lower_bound(nodes.begin(), nodes.end(), number,
                          [](const auto& node, std::uint64_t n) { return node.step.first < n; });
}

// Puts any number in the place of one.
template <class T>
void replace(std::vector<T>& all, typename std::vector<T>::iterator one,
             const std::vector<T>& with) {
  if (with.empty()) {
    all.erase(one);
    return;
  }
  *one = with.front();
  all.insert(one + 1, with.begin() + 1, with.end());
}

}  // namespace

// Whatever rounds makes it hold for less.
OctreePool::Plan::Answer::Answer(const ValidityRegion& held, const Vec3& from, bool is_empty)
    : until_s(held.until_s),
      middle_m(held.place - from),
      give_m(static_cast<float>(held.give_m - kPlanRounding_m)),
      threshold(static_cast<float>(held.threshold * (1 + 1e-6))),
      empty(is_empty) {}

void OctreePool::note_missing(const Step& step, double most, double to_threshold) {
  const double highest =
      std::max(most, bound(*step.entry, copies_[step.copy], step.entry->highest_key));
  most_missed_ = std::max(most_missed_, highest / to_threshold);
  if (!loader_.has_failed(*step.entry)) missed_.push_back({most / to_threshold, *step.entry, true});
}

void OctreePool::begin_plan(const Vec3& soon) {
  next_.clear();
  const Vec3 half_way = (soon - place_) / 2.0;
  const double give_m = std::max(kPlanReach * length(half_way), kLeastReach_m);
  if (trees_.size() != 1 || give_m > kMostReach_m) return;
  next_.place = place_ + half_way;
  next_.give_m = give_m;
  next_.threshold = kLower * shortlists_.lowest_of_late();
  next_.until_s = until_s_;
  next_.lists = shortlists_.numbering();
  const PageEntry& top = trees_.back();
  next_.copies.push_back({&top, {}, next_.place, 1, SignalMaps::kNone, false});
  next_.steps.push_back({&top, 0, 0, 0, std::numeric_limits<double>::infinity()});
}

void OctreePool::plan_ahead(const Vec3& soon) {
  if (!on_.plans) return;
  if (keyframes_to_rest_ > 0) {
    --keyframes_to_rest_;
    return;
  }
  if (next_.steps.empty()) {
    const double margin_m = plan_.give_m / 4;
    if (plan_.holds(soon, kFalls * looked_for_, time_s_ + kPlanHold_s, margin_m)) return;
    begin_plan(soon);
  }
  const std::size_t most = kLeastSteps + plan_.nodes.size() / kParts;
  LastNodes last;
  if (plan_.lists == shortlists_.numbering() && !next_.steps.empty())
    last = LastNodes({first_from(plan_.nodes, next_.steps.back().first), plan_.nodes.end()});
  for (std::size_t s = 0; s < most && !next_.steps.empty() && steps_left_ > 0; ++s, --steps_left_) {
    if (is_exhausted()) break;
    spend(WorkBudget::kStepOfPlan);
    last.prefetch();
    go_a_step(next_, last);
  }
  if (next_.nodes.size() > kMostPlanned) next_.clear();
  if (next_.steps.empty() && next_.give_m >= 0) {
    next_.take_over(plan_);
    std::swap(plan_, next_);
    next_.clear();
  }
}

// None of which has been asked.
void OctreePool::Plan::make_parts() {
  parts.clear();
  for (std::uint32_t n = 0; n < nodes.size(); ++n) {
    const std::uint64_t block = Part::block_of(nodes[n].step.first);
    if (parts.empty() || parts.back().block != block) {
      Part& part = parts.emplace_back();
      part.block = block;
      part.first = n;
    }
    parts.back().last = n + 1;
  }
}

// What parts had found before, of those that are still as they were.
template <class IsAsBefore>
void OctreePool::Plan::take_parts(std::vector<Part>& before, const IsAsBefore& is_as_before) {
  auto last = before.begin();
  for (Part& part : parts) {
    while (last != before.end() && last->block < part.block) ++last;
    if (last == before.end()) return;
    if (last->block != part.block || last->scope.give_m < 0 || !is_as_before(*last, part)) continue;
    part.scope = last->scope;
    part.keyframe = last->keyframe;
    part.heard.swap(last->heard);
  }
}

// What is known of nodes that are in both, as far as it does not follow from the last plan alone.
// Both are by ascending numbers.
void OctreePool::Plan::take_over(Plan& last) {
  LastNodes before(last.nodes);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const Node* const known = before.find(nodes[n].step.first, nodes[n].offset);
    if (known == nullptr || nodes[n].page == nullptr) continue;
    const Answer& answer = last.asked[static_cast<std::size_t>(known - last.nodes.data())];
    if (answer.by_plan) continue;
    asked[n] = answer;
    asked[n].middle_m += Vec3f(last.place - place);
  }
  make_parts();
  if (copies.size() != 1 || last.copies.size() != 1) return;
  // What the last plan had and this one has not does not matter where this one holds.
  take_parts(last.parts, [&last](const Part& part, const Part&) {
    const Scope& scope = part.scope;
    return last.holds(scope.place, scope.threshold, scope.until_s, scope.give_m);
  });
}

const OctreePool::Plan::Node* OctreePool::LastNodes::find(std::uint64_t first,
                                                          std::uint64_t offset) {
  while (!nodes_.empty() && nodes_[0].step.first < first) nodes_ = nodes_.subspan(1);
  const bool is_it = !nodes_.empty() && nodes_[0].offset == offset && nodes_[0].page != nullptr;
  return is_it ? &nodes_[0] : nullptr;
}

void OctreePool::LastNodes::prefetch() const {
  if (nodes_.size() <= 2 * kPagesAhead) return;
  if (const ResidentPage* const soon = nodes_[2 * kPagesAhead].page)
    __builtin_prefetch(&soon->links);
  if (const ResidentPage* const soon = nodes_[kPagesAhead].page)
    prefetch_to_read(soon->links.children.data(), soon->links.children.size() * sizeof(PageEntry));
}

void OctreePool::go_a_step(Plan& plan, LastNodes& last) {
  ++planned_;
  const Step step = plan.steps.back();
  plan.steps.pop_back();
  const PageEntry& entry = *step.entry;
  const Plan::Node* const known = last.find(step.first, entry.page.offset);
  PageLoader::Place* const kept = known != nullptr ? known->kept : loader_.place_of(entry);
  const ResidentPage* const page = kept != nullptr ? kept->resident() : nullptr;
  if (page == nullptr || entry.source_count > 0) {
    Plan::Node& node = plan.nodes.emplace_back();
    plan.asked.emplace_back();
    node.step = step;
    node.step.most = bound(entry, plan.copies[step.copy], entry.highest_key);
    node.widest = step.most;
    node.offset = entry.page.offset;
    node.page = page;
    node.kept = kept;
    if (page == nullptr) {
      plan.missing.push_back({&entry, step.first, node.widest});
    } else {  // who knows the page need not touch it
      node.sources = known != nullptr ? known->sources : page->sources.data();
      node.list = known != nullptr ? known->list : shortlists_.number_of(step.first);
    }
  }
  if (page == nullptr || entry.sources_below == entry.source_count) return;
  std::uint64_t first = step.first + entry.source_count;
  for (const PageEntry& child : page->links.children) first += child.sources_below;
  const Copy copy = plan.copies[step.copy];
  // The last child first, so that nodes are visited by ascending numbers.
  for (auto child = page->links.children.rbegin(); child != page->links.children.rend(); ++child) {
    first -= child->sources_below;
    const double highest = bound(*child, copy, child->highest_key, plan.give_m);
    if (!(highest > 0 && highest >= plan.threshold)) continue;
    std::uint32_t number = step.copy;
    if (child->octant == kNoOctant) {  // an octree of its own
      number = static_cast<std::uint32_t>(plan.copies.size());
      plan.copies.push_back(copy);
      plan.copies.back().tree = &*child;
    }
    plan.steps.push_back({&*child, number, first, 0, highest});
  }
}

void OctreePool::rest_from_plans() {
  forget_plans();
  keyframes_to_rest_ = kRest_keyframes;
}

// Takes in what has come: where a node was missing it is, and what is below.
void OctreePool::complete_plan(Plan& plan) {
  const std::span<const std::uint64_t> came = loader_.arrived();
  const auto has_come = [&](const Plan::Missing& one) {
    return std::binary_search(came.begin(), came.end(), one.entry->page.offset);
  };
  if (std::none_of(plan.missing.begin(), plan.missing.end(), has_come)) return;
  const std::vector<Plan::Missing> missing = std::exchange(plan.missing, {});
  std::vector<Plan::Node> nodes = std::exchange(plan.nodes, {});
  std::vector<Plan::Answer> asked = std::exchange(plan.asked, {});
  std::vector<Step> steps = std::exchange(plan.steps, {});
  LastNodes none;
  bool erased = false;
  for (const Plan::Missing& one : missing) {
    if (!has_come(one)) {
      plan.missing.push_back(one);
      continue;
    }
    const auto here =
        std::find_if(first_from(nodes, one.first), nodes.end(),
                     [&](const Plan::Node& node) { return node.offset == one.entry->page.offset; });
    if (here == nodes.end() || nodes.size() > kMostPlanned) continue;
    plan.nodes.clear();
    plan.asked.clear();
    plan.steps.push_back(here->step);
    plan.steps.back().most = here->widest;
    while (!plan.steps.empty()) go_a_step(plan, none);
    replace(asked, asked.begin() + (here - nodes.begin()), plan.asked);
    replace(nodes, here, plan.nodes);
    erased = erased || plan.nodes.empty();
  }
  plan.nodes = std::move(nodes);
  plan.asked = std::move(asked);
  plan.steps = std::move(steps);
  if (plan.nodes.size() > kMostPlanned) plan.clear();
  std::vector<Plan::Part> parts = std::exchange(plan.parts, {});
  plan.make_parts();
  // Of as many nodes as before: they are the same, and what is found of one that was missing holds
  // only where that does not matter.
  plan.take_parts(parts, [erased](const Plan::Part& before, const Plan::Part& now) {
    return !erased && before.last - before.first == now.last - now.first;
  });
}

// What is missing of the plan, if it reaches as far; false if not.
bool OctreePool::soon_by_plan(const Vec3& soon, double tau) {
  if (soon == place_ || !plan_.holds(soon, tau, time_s_)) return false;
  soon_.clear();
  Copy copy{};
  copy.place = soon;
  for (const Plan::Missing& one : plan_.missing) {
    if (one.widest < tau) continue;
    const double highest = bound(*one.entry, copy, one.entry->highest_key);
    if (highest > 0 && highest >= tau && !loader_.has_failed(*one.entry))
      soon_.push_back({highest, *one.entry, false});
  }
  return true;
}

// What is soon needed changes slowly: where there is no plan, a walk every few keyframes does.
void OctreePool::look_ahead(const Vec3& soon, double tau) {
  if (soon_by_plan(soon, tau)) return;
  if (++asks_ % kAsksPerLookAhead != 1 && soon != place_) return;
  soon_.clear();
  if (soon == place_) return;
  walk(
      soon, tau, [this](const PageEntry& entry, double) { return loader_.find(entry); },
      [&](const Step& step, const ResidentPage* page, ValidityRegion&) {
        const double urgency = step.most / copies_[step.copy].to_threshold;
        if (page == nullptr && urgency > 0 && !loader_.has_failed(*step.entry))
          soon_.push_back({urgency, *step.entry, false});
        return !is_exhausted();
      },
      [](const FarCopy&, double) {});
}

}  // namespace clamor
