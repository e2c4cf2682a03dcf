// octree_plan.cpp: how OctreePool does without a walk in most keyframes.
//
// A walk costs a microsecond per node, of which there are thousands where lobes are sharp, and a
// keyframe later it would come by nearly the same. So the next walk is begun early, for all places
// within a ball that reaches as far ahead as pages are asked for, and done part by part, one with
// each keyframe; what it finds is a plan: nodes, one after the other. As long as it holds, a
// keyframe goes through that, and leaves out nodes whose list is empty or whose bound is too low.
//
// Pages that come are taken in. Pages that go end it, as does whatever changes bounds; and where
// they go for want of memory, none is made for a while: it would ask for more than fits again.
// Levels with copies have none: what is found in copies is placed anew in each keyframe anyway.
#include <algorithm>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "runtime/octree/octree_pool.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

namespace {

constexpr double kPlanReach = 5;  // of the way to where pages are asked for, of half of it
constexpr double kLeastReach_m = 0.3;
constexpr double kMostReach_m = 3;
constexpr double kLower = 0.6;        // than the lowest threshold of late
constexpr double kFalls = 0.8;        // a threshold, before the next plan is made
constexpr double kPlanHold_s = 0.3;   // a new one must hold for at least that
constexpr double kNodeGive_m = 0.25;  // that a node which is too quiet is not asked again for
constexpr double kRounds_m = 1e-4;    // places seen from the middle of a plan
constexpr std::uint32_t kAsksPerLookAhead = 4;
constexpr std::size_t kPagesAhead = 2, kNodesAhead = 16;
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

bool OctreePool::look_by_plan(const Vec3& place, double threshold, std::size_t most,
                              std::vector<FoundSource>& found) {
  copies_ = plan_.copies;
  for (Copy& copy : copies_) copy.place = place;
  const bool renumbered = plan_.lists != shortlists_.numbering();
  plan_.lists = shortlists_.numbering();
  if (renumbered)
    for (Plan::Node& node : plan_.nodes)
      if (node.page != nullptr) node.list = shortlists_.number_of(node.step.first);
  find_lists_to_renew(place, threshold);
  renew_lists(place, threshold);
  heard_.clear();
  for (std::uint32_t n = 0; n < plan_.asked.size(); ++n)
    if (!plan_.asked[n].empty) heard_.push_back(n);
  const auto node_of = [this](std::size_t h) -> const Plan::Node& {
    return plan_.nodes[heard_[h]];
  };
  for (std::size_t h = 0; h < heard_.size(); ++h) {
    if (h + 2 * kNodesAhead < heard_.size())
      prefetch_to_read(&node_of(h + 2 * kNodesAhead), sizeof(Plan::Node));
    if (h + kNodesAhead < heard_.size()) {
      const Plan::Node& soon = node_of(h + kNodesAhead);
      shortlists_.prefetch(soon.list);
      __builtin_prefetch(soon.kept, 1);
    }
    const Plan::Node& node = node_of(h);
    shortlists_.use(node.list, looked_at_);
    loader_.use(*node.kept, node.step.most);
    met_.push_back({node.step, node.sources, node.list, threshold, false, true});
    if (met_.size() == kMostMet) pass_met(found);
    if (found.size() > most) return false;
  }
  pass_met(found);
  looked_for_ = threshold;
  return found.size() <= most;
}

// Whatever rounds makes it hold for less.
OctreePool::Plan::Answer::Answer(const Quiet& held, const Vec3& from, bool is_empty)
    : until_s(held.until_s),
      middle_m(held.place - from),
      threshold(static_cast<float>(held.threshold * (1 + 1e-6))),
      empty(is_empty) {
  const auto give_m = static_cast<float>(held.give_m - kRounds_m);
  give2_m2 = give_m >= 0 ? give_m * give_m : -1;
}

// Those that do not hold, of nodes that matter now; and notes what is missing of these. A node of
// which nothing matters is not asked again for a while.
void OctreePool::find_lists_to_renew(const Vec3& place, double threshold) {
  due_.clear();
  const Vec3f place_m(place - plan_.place);
  for (std::uint32_t n = 0; n < plan_.asked.size(); ++n)
    if (!plan_.asked[n].holds(place_m, threshold, time_s_)) due_.push_back(n);
  renewed_.clear();
  for (std::size_t d = 0; d < due_.size(); ++d) {
    if (d + 2 * kNodesAhead < due_.size())
      prefetch_to_read(&plan_.nodes[due_[d + 2 * kNodesAhead]], sizeof(Plan::Node));
    if (d + kNodesAhead < due_.size()) {
      const Plan::Node& soon = plan_.nodes[due_[d + kNodesAhead]];
      if (soon.page != nullptr) shortlists_.prefetch(soon.list);
      prefetch_to_read(soon.step.entry, sizeof(PageEntry));
    }
    const std::uint32_t n = due_[d];
    const Plan::Node& node = plan_.nodes[n];
    Plan::Answer& asked = plan_.asked[n];
    const auto is_quiet = [&](double give_m, double above) {
      asked = {{place, give_m, above, until_s_}, plan_.place, true};
    };
    asked = {};
    if (node.widest < threshold) {
      is_quiet(std::numeric_limits<double>::infinity(), node.widest);
      asked.by_plan = true;
      continue;
    }
    const bool holds = node.page != nullptr && shortlists_.holds(node.list, place, threshold);
    if (!holds) {
      const PageEntry& entry = *node.step.entry;
      const Copy& copy = copies_[node.step.copy];
      const double highest = bound(entry, copy, entry.highest_key);
      if (!(highest > 0 && highest >= threshold)) {
        is_quiet(kNodeGive_m, bound(entry, copy, entry.highest_key, kNodeGive_m));
        continue;
      }
      if (node.page == nullptr) {
        loader_.use(entry, highest);  // counts it as late
        note_missing(node.step, highest, 1);
        continue;
      }
    }
    renewed_.push_back(n);
  }
}

void OctreePool::renew_lists(const Vec3& place, double threshold) {
  const auto page_of = [this](std::size_t r) { return plan_.nodes[renewed_[r]].page; };
  for (std::size_t r = 0; r < renewed_.size(); ++r) {
    if (r + 4 * kPagesAhead < renewed_.size())
      __builtin_prefetch(&page_of(r + 4 * kPagesAhead)->sources);
    if (r + 2 * kPagesAhead < renewed_.size()) {
      page_of(r + 2 * kPagesAhead)->sources.prefetch_sieves();
      shortlists_.prefetch_kept(plan_.nodes[renewed_[r + 2 * kPagesAhead]].list);
    }
    if (r + kPagesAhead < renewed_.size()) page_of(r + kPagesAhead)->sources.prefetch();
    const Plan::Node& node = plan_.nodes[renewed_[r]];
    shortlists_.renew(node.list,
                      {node.page->sources, *node.step.entry, node.step.first, place, threshold,
                       nullptr, maps_, SignalMaps::kNone},
                      looked_at_);
    plan_.asked[renewed_[r]] = {shortlists_.held(node.list), plan_.place,
                                shortlists_.is_empty(node.list)};
    ++visited_;
  }
}

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

// What is known of nodes that are in both, as far as it does not follow from the last plan alone.
// Both are by ascending numbers.
void OctreePool::Plan::take_over(const Plan& last) {
  LastNodes before(last.nodes);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const Node* const known = before.find(nodes[n].step.first, nodes[n].offset);
    if (known == nullptr || nodes[n].page == nullptr) continue;
    const Answer& answer = last.asked[static_cast<std::size_t>(known - last.nodes.data())];
    if (answer.by_plan) continue;
    asked[n] = answer;
    asked[n].middle_m += Vec3f(last.place - place);
  }
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
  }
  plan.nodes = std::move(nodes);
  plan.asked = std::move(asked);
  plan.steps = std::move(steps);
  if (plan.nodes.size() > kMostPlanned) plan.clear();
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
      [&](const Step& step, const ResidentPage* page, Quiet&) {
        const double urgency = step.most / copies_[step.copy].to_threshold;
        if (page == nullptr && urgency > 0 && !loader_.has_failed(*step.entry))
          soon_.push_back({urgency, *step.entry, false});
        return true;
      },
      [](const FarCopy&, double) {});
}

}  // namespace clamor
