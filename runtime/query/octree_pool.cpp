#include "runtime/query/octree_pool.h"

#include <algorithm>
#include <cassert>
#include <new>
#include <utility>

#include "runtime/query/query_constants.h"

namespace clamor {

using namespace query;

PageLoader::Fetch page_fetch(const BakeFile& file, const RadiationModel& field,
                             const SignalWeights& weights) {
  return [&](const PageEntry& entry) -> PageLoader::Content {
    try {
      auto page = file.read_page(entry);
      if (!page.ok()) return page.error();
      return std::make_unique<const ResidentPage>(
          entry, SourcePage(field, weights.by_signal, std::move(page->sources)),
          std::move(page->links), file.trees());
    } catch (const std::bad_alloc&) {
      return Error(file.path() + ": a page of it finds no memory; close other programs.");
    }
  };
}

// --- A keyframe ---------------------------------------------------------------------------------

OctreePool::OctreePool(const RadiationModel& field, const SignalWeights& weights,
                       std::span<const PageEntry> trees,
                       std::span<const std::vector<std::uint32_t>> signal_maps, PageLoader& loader)
    : context_(field, weights, trees, signal_maps),
      loader_(loader),
      shortlists_(field, weights),
      traversal_(context_),
      fronts_(context_, loader, shortlists_),
      requests_(loader) {
  for (const PageEntry& top : trees) load_first_pages(top);
  update_representatives();
}

// Nodes that hold instances only have nothing that could stand for what is missing below them.
void OctreePool::load_first_pages(const PageEntry& top) {
  std::vector<const PageEntry*> first = {&top};
  for (std::size_t i = 0; i < std::min(first.size(), kMaxFirstPages); ++i)
    if (loader_.load_now(*first[i]) && first[i]->source_count == 0)
      for (const PageEntry& child : loader_.find(*first[i])->links.children)
        first.push_back(&child);
}

void OctreePool::update_representatives() {
  context_.representatives.update([this](const PageEntry& entry) { return loader_.find(entry); });
}

void OctreePool::ablate(const QuerySwitches& on) {
  on_ = on;
  shortlists_.keep(on.shortlists);
  context_.use_representatives = on.representatives;
}

bool OctreePool::refresh() {
  stage_ = Stage::kRefreshed;
  const bool changed = loader_.begin_sample();
  if (changed) {
    update_representatives();
    fronts_.refresh();
  }
  return changed;
}

void OctreePool::begin(const Vec3& place, double time_s) {
  assert(stage_ == Stage::kRefreshed && "refresh() comes first");
  stage_ = Stage::kBegun;
  if (time_s < query_.until_s) fronts_.forget();
  query_.until_s = time_s;
  context_.steps_left = kMaxSteps;
  context_.bounds.begin(place, time_s);
  shortlists_.begin(place, time_s, context_.bounds.max_share(), context_.bounds.until_s());
}

void OctreePool::set_occlusion_bounds(const OcclusionUpperBounds* bounds) {
  shortlists_.set_occlusion_bounds(on_.occlusion ? bounds : nullptr);
}

void OctreePool::set_late_boost(float strength) {
  if (!on_.late_boost) strength = 0;
  if (strength != context_.bounds.late_boost()) fronts_.forget();
  context_.bounds.set_late_boost(strength);
}

bool OctreePool::is_exhausted() {
  spend(shortlists_.take_work() + std::exchange(context_.work, 0));
  return SourcePool::is_exhausted();
}

double OctreePool::highest(const Vec3& place) {
  if (context_.trees.empty()) return 0;
  const PageEntry& top = context_.trees.back();
  // The emission cone of the top may point away from the place, which makes a bound of 0.
  return std::max(context_.bounds.bound(top, top.highest_key, place), 1e-30);
}

Source* OctreePool::placed(const Source& stored, const Placement& placement,
                           double representative_key) {
  if (std::uint64_t{stored.emitter} + placement.emitters >= field_.emitter_count())
    return nullptr;  // of a forged file
  if (placed_count_ == placed_.size()) placed_.emplace_back();
  Source& source = placed_[placed_count_++];
  source = placement.place(stored);
  if (representative_key > 0) {
    const double power = std::accumulate(stored.power.begin(), stored.power.end(), 0.0);
    source.u = static_cast<float>(std::min(1.0, power / representative_key));
  }
  return &source;
}

void OctreePool::add_source(const Step& step, const Source* sources, std::size_t index, bool leads,
                            std::uint32_t signal, double ceiling, float boost, double least,
                            std::vector<FoundSource>& found) {
  const Source* source = sources + index;
  const Copy& copy = copies_[step.copy];
  const BoostedBound boosted(boost, copy.moved ? 0 : strength_, ceiling);
  if (boosted.ceiling < least) return;
  SourcePage::prefetch(*source);  // to be weighed
  if (copy.moved) source = placed(*source, copy.placement, leads ? step.representative_key : 0);
  if (source == nullptr) return;
  spend(WorkBudget::kFound);
  found.push_back({source, step.first + index, signal, step.copy, boosted.boost,
                   boosted.ceiling / copy.to_threshold});
}

void OctreePool::add_far(const FarCopy& far, double ceiling, std::vector<FoundSource>& found) {
  const InstanceRepresentative& lead = *far.lead;
  const Placement tree = within(far.outer->placement, far.copy->placement);
  const Source* const source = placed(lead.source, within(tree, lead.placement),
                                      far.representative_key / lead.placement.power);
  if (source == nullptr) return;
  spend(WorkBudget::kFound);
  found.push_back({source, far.first + lead.number, far.signal, kNoCopy, 1, ceiling});
}

bool OctreePool::look(const Vec3& place, double threshold, std::size_t most,
                      std::vector<FoundSource>& found) {
  place_ = place;
  placed_count_ = 0;
  met_.clear();
  missed_.clear();
  nearly_.clear();
  most_missed_ = -1;
  if (plan_.holds(place, threshold, time_s_)) return look_by_plan(place, threshold, most, found);
  plan_.forget_answers();  // a walk makes lists anew, for where it is
  const auto use = [this](const PageEntry& entry, double urgency) {
    ++visited_;
    return loader_.use(entry, urgency);
  };
  const bool is_unlimited = most > kMaxPlaced;
  const auto visit = [&](const Step& step, const ResidentPage* page, ValidityRegion& quiet) {
    const Copy& copy = copies_[step.copy];
    const double least = threshold * copy.to_threshold;
    if (page == nullptr) {
      note_missing(step, step.most, copy.to_threshold);
      return true;
    }
    if (step.entry->source_count == 0) {
      quiet = {copy.place, kGiveWithoutSources_m, 0, until_s_};
      return true;
    }
    const bool leads = step.representative_key > 0 && page->leader == ResidentPage::Leader::kSource;
    if (leads)
      add_source(step, page->sources.data(), 0, true,
                 maps_.signal(copy.map, field_.signal(page->sources[0])),
                 std::numeric_limits<double>::infinity(),
                 field_.late_boost().at(page->sources[0].delay_s), least, found);
    if (!on_.shortlists) {
      pass_without_list(step, *page, threshold, found);
      quiet.give_m = -1;
      return found.size() <= most && !is_exhausted();
    }
    const MetPage met{page->sources,
                      *step.entry,
                      step.first,
                      {copy.place, 0, least, time_s_},
                      copy.moved ? &copy.placement : nullptr,
                      maps_,
                      copy.map,
                      copy.off_m};
    const std::size_t list = shortlists_.list_of(met, quiet, looked_at_);
    quiet = quiet.seen_from(copy.place);
    if (!shortlists_.is_empty(list))
      met_.push_back({step, page->sources.data(), list, least, leads, 0});
    if (met_.size() == kMostMet) pass_met(found);
    if (is_unlimited && placed_count_ >= kMaxPlaced) steps_left_ = 0;
    return found.size() <= most && !is_exhausted();
  };
  const auto heard = [&](const FarCopy& far, double ceiling) {
    ++copies_heard_;
    add_far(far, ceiling, found);
  };
  if (!walk(place, threshold, use, visit, heard)) return false;
  pass_met(found);
  looked_for_ = threshold;
  return found.size() <= most && !is_exhausted();
}

void OctreePool::pass_without_list(const Step& step, const ResidentPage& page, double threshold,
                                   std::vector<FoundSource>& found) {
  const Copy copy = copies_[step.copy];
  const double least = threshold * copy.to_threshold;
  const bool leads = step.representative_key > 0 && page.leader == ResidentPage::Leader::kSource;
  looked_at_ += page.sources.pass(
      copy.place, least,
      [&](std::size_t index, double ceiling, const CullRecord& part) {
        if (leads && index == 0) return;
        const std::uint32_t signal = maps_.signal(copy.map, field_.signal(part.emitter));
        if (hidden_ != nullptr &&
            ceiling * static_cast<double>(hidden_->upper_bound(step.first + index)) <
                least * (1 - 1e-6))
          return;
        add_source(step, page.sources.data(), index, false, signal, ceiling,
                   field_.late_boost().at(part.delay_s), least, found);
      },
      CullMargin{copy.off_m, 1});
  spend(WorkBudget::kCulledSource * page.sources.size() / 8);
}

bool OctreePool::look_without_lists(double threshold, std::size_t most,
                                    std::vector<FoundSource>& found) {
  for (const Plan::Node& node : plan_.nodes) {
    if (node.widest < threshold) continue;
    const PageEntry& entry = *node.step.entry;
    const double now = bound(entry, copies_[node.step.copy], entry.highest_key);
    if (!(now > 0 && now >= threshold)) continue;
    ++visited_;
    if (node.page == nullptr) {
      loader_.use(entry, now);
      note_missing(node.step, now, 1);
      continue;
    }
    loader_.use(*node.kept, node.step.most, turns_ahead_);
    pass_without_list(node.step, *node.page, threshold, found);
    if (found.size() > most || is_exhausted()) return false;
  }
  looked_for_ = threshold;
  return true;
}

void OctreePool::pass_met(std::vector<FoundSource>& found) {
  asked_lists_.clear();
  for (const Met& met : met_) {
    const Copy& copy = copies_[met.step.copy];
    asked_lists_.push_back({met.list, copy.place, met.least, copy.off_m});
  }
  shortlists_.pass(asked_lists_, [&](const PageShortlists::Passed& one) {
    const Met& met = met_[one.asked];
    if (met.leads && one.index == 0) return;
    if (is_too_quiet(one.ceiling * static_cast<double>(one.share), one.known,
                     met.step.first + one.index, met.least))
      return;
    add_source(met.step, met.sources, one.index, false, one.signal, one.ceiling, one.boost,
               met.least, found);
  });
  met_.clear();
}

// Down through the cubes that hold the source, to the first page that is missing and matters. A
// child has the octants up to the next child's; empty ones among them count as its own, which is
// right, since everything in them is in memory.
double OctreePool::unseen_key(const FoundSource& found, double tau) {
  // No other source of an instance that was not traversed could reach the threshold.
  if (!requests_.is_missing(tau) || found.copy == kNoFrame) return 0;
  const Frame& frame = traversal_.frame(found.copy);
  const Vec3 position_m = frame.placement.inside(Vec3(found.source->position_m));
  const PageEntry* entry = frame.tree;
  OctreeCube cube = OctreeCube::around(Vec3(entry->low_m), Vec3(entry->high_m));
  while (entry != nullptr) {
    if (traversal_.bound(*entry, frame, entry->highest_key) < tau * frame.to_threshold) return 0;
    const ResidentPage* const page = loader_.find(*entry);
    if (page == nullptr) return entry->highest_key * frame.placement.power;
    const std::size_t octant = cube.octant_of(position_m);
    entry = nullptr;
    for (const PageEntry& child : page->links.children)
      if (child.octant <= octant && (entry == nullptr || child.octant > entry->octant))
        entry = &child;
    if (entry != nullptr) cube = cube.child(entry->octant);
  }
  return 0;
}

void OctreePool::ask(const Vec3& soon, double tau) {
  assert(stage_ == Stage::kQueried && "look() comes first");
  stage_ = Stage::kIdle;
  shortlists_.add_threshold(threshold_);
  if (on_.front) {
    std::size_t steps = fronts_.prepare({query_.centre, 0, threshold_, query_.until_s}, soon);
    for (; steps > 0 && !is_exhausted() && fronts_.grow(); --steps) {
      spend(WorkBudget::kFrontStep);
      ++totals_.front_nodes;
    }
  }
  if (context_.trees.empty()) return;
  find_pages_soon(soon, tau);
  requests_.send(tau);
}

// The pages that are missing at the place of the next half second: from the front if it reaches as
// far, else by a traversal every few keyframes, since they change slowly.
void OctreePool::find_pages_soon(const Vec3& soon, double tau) {
  const ValidityRegion query{soon, 0, tau, query_.until_s};
  const bool by_front = soon != query_.centre && fronts_.holds(query);
  if (!by_front && !requests_.is_look_ahead_due() && soon != query_.centre) return;
  requests_.clear_soon();
  if (soon == query_.centre) return;
  if (by_front) {
    for (const NodeFront::Node& node : fronts_.current().nodes()) {
      if (node.page != nullptr || node.at.bound < tau) continue;
      const PageEntry& entry = *node.at.entry;
      const double bound = context_.bounds.bound(entry, entry.highest_key, soon);
      if (bound >= tau) requests_.add_soon(entry, bound);
    }
    return;
  }
  traversal_.start(query);
  for (OctreeTraversal::Node node; traversal_.next(node) && !is_exhausted();) {
    spend(WorkBudget::kNode);
    if (const ResidentPage* const page = loader_.find(*node.entry))
      traversal_.expand(node, *page);
    else
      requests_.add_soon(*node.entry, node.bound / traversal_.frame(node.frame).to_threshold);
  }
}

}  // namespace clamor
