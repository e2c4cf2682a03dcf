#include "runtime/query/octree_pool.h"

#include <algorithm>
#include <limits>
#include <new>
#include <numeric>
#include <utility>

namespace clamor {

namespace {

constexpr double kSoon_s = 0.5;                   // pages are asked for so long before they sound
constexpr double kWindow_s = 2, kLeast_s = 1.25;  // that signals are bounded for at a time
constexpr double kGiveWithoutSources_m = 1;
constexpr double kGiveInTime_s = 0.05;   // of delays rounded, and of moments
constexpr double kPlaceGive_m = 0.002;   // quantised positions, 10 km from the origin
constexpr std::size_t kMostFirst = 256;  // pages of a tree that are always here
constexpr std::size_t kMostAsked = 256;  // pages at a time
// Of the time since the last keyframe, that the next may take; and of signals bounded at once.
constexpr double kTimeOfStep = 1.25, kMostAhead_s = 0.055;

}  // namespace

SignalWeights max_over_instances(const SignalWeights& weights,
                                 std::span<const std::vector<std::uint32_t>> signal_maps) {
  SignalWeights highest = weights;
  // Copies within copies play what one map after another gives.
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& map : signal_maps)
      for (std::size_t signal = 0; signal < map.size(); ++signal)
        for (std::size_t b = 0; b < kBandCount; ++b) {
          float& here = highest.by_signal[signal][b];
          const float there = highest.by_signal[map[signal]][b];
          changed = changed || there > here;
          here = std::max(here, there);
        }
  }
  return highest;
}

PageLoader::Fetch page_fetch(const BakeFile& file, const RadiationModel& field,
                             const SignalWeights& ceilings) {
  return [&](const PageEntry& entry) -> PageLoader::Content {
    try {
      auto page = file.read_page(entry);
      if (!page.ok()) return page.error();
      return std::make_unique<const ResidentPage>(
          entry, SourcePage(field, ceilings.by_signal, std::move(page->sources)),
          std::move(page->links), file.trees());
    } catch (const std::bad_alloc&) {
      return Error(file.path() + ": a page of it finds no memory; close other programs.");
    }
  };
}

OctreePool::OctreePool(const RadiationModel& field, const SignalWeights& ceilings,
                       std::span<const PageEntry> trees,
                       std::span<const std::vector<std::uint32_t>> signal_maps, PageLoader& loader)
    : field_(field),
      trees_(trees),
      signal_maps_(signal_maps),
      ceilings_(ceilings),
      audible_(ceilings.by_signal),
      priority_bound_(field, ceilings.by_signal),
      loader_(loader),
      maps_(signal_maps),
      shortlists_(field, ceilings),
      leads_(field, trees, maps_) {
  for (const PageEntry& top : trees) load_first_pages(top);
  update_representatives();
}

void OctreePool::update_representatives() {
  leads_.follow([this](const PageEntry& entry) { return loader_.find(entry); });
}

bool OctreePool::refresh() {
  const bool changed = loader_.begin_sample();
  if (changed) {
    update_representatives();
    if (loader_.has_dropped()) rest_from_plans();
    complete_plan(plan_);
    complete_plan(next_);
  }
  return changed;
}

// Nodes of copies alone have nothing that could stand for what is missing below them.
void OctreePool::load_first_pages(const PageEntry& top) {
  std::vector<const PageEntry*> first = {&top};
  for (std::size_t i = 0; i < std::min(first.size(), kMostFirst); ++i)
    if (loader_.load_now(*first[i]) && first[i]->source_count == 0)
      for (const PageEntry& child : loader_.find(*first[i])->links.children)
        first.push_back(&child);
}

void OctreePool::begin(const Vec3& place, double time_s) {
  steps_left_ = kMostSteps;
  if (time_s < time_s_) {
    quiet_.clear();
    forget_plans();
  }
  // The next keyframes most likely come after as long a time as this one.
  ahead_s_ = kTimeOfStep * (kTurns - 1) * (time_s - time_s_);
  const bool is_soon = ahead_s_ > 0 && ahead_s_ <= kMostAhead_s;
  if (!on_.turns || !is_soon || !may_lag_ || trees_.size() != 1) ahead_s_ = 0;
  turns_ahead_ = ahead_s_ > 0 ? kTurns - 1 : 0;
  step_m_ = place - std::exchange(keyframe_place_, place);
  ++keyframe_;
  time_s_ = time_s;
  if (ceilings_.steady() || trees_.empty())
    until_s_ = std::numeric_limits<double>::infinity();
  else if (time_s < from_s_ || time_s + kLeast_s > until_s_ ||
           length(place - around_) > PageShortlists::kMostGive_m)
    bound_signals(place, time_s);
  shortlists_.begin(place, time_s, ahead_s_, loudest_, until_s_);
  shortlists_.set_occlusion_bounds(hidden_, turns_ahead_);
}

void OctreePool::set_occlusion_bounds(const OcclusionUpperBounds* hidden, bool may_lag) {
  if ((on_.occlusion && hidden != hidden_) || may_lag != may_lag_) plan_.make_parts();
  hidden_ = on_.occlusion ? hidden : nullptr;
  may_lag_ = may_lag;
}

// For a while, and wherever lists that are made in that while hold: they are made up to that far
// from here, their middles are nearly as far ahead, and they hold as far round those.
void OctreePool::bound_signals(const Vec3& place, double time_s) {
  around_ = place;
  from_s_ = time_s;
  until_s_ = time_s + kWindow_s;
  const PageEntry& top = trees_.back();
  const Vec3 low(top.low_m), high(top.high_m);
  const double farthest_m = length(place - (low + high) / 2.0) + length(high - low) / 2 +
                            kPlaceGive_m + 3 * PageShortlists::kMostGive_m;
  const double longest_s =
      top.max_delay_s + farthest_m / field_.speed_of_sound_mps() + kGiveInTime_s;
  std::vector<Bands> audible;
  loudest_ = 0;
  for (const LoudnessTrack& track : ceilings_.tracks) {
    const Bands& most =
        audible.emplace_back(track.max_between(time_s - longest_s - field_.latest_start_s(),
                                               until_s_ + kSoon_s - field_.earliest_start_s()));
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (track.max()[b] > 0) loudest_ = std::max<double>(loudest_, most[b] / track.max()[b]);
  }
  loudest_ = std::max(loudest_ * (1 + 1e-6), 1e-9);
  if (audible == audible_) return;
  audible_ = std::move(audible);
  SignalWeights weights;
  weights.by_signal = audible_;
  priority_bound_ = PriorityBound(field_, max_over_instances(weights, signal_maps_).by_signal);
}

double OctreePool::highest(const Vec3& place) {
  if (trees_.empty()) return 0;
  const PageEntry& top = trees_.back();
  // Its cone may point away from the place, which makes a bound of 0.
  return std::max(top.highest_key * priority_bound_.per_key(top, place, 1) * most_boost(top),
                  1e-30);
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
// child has the octants up to the next one's: those that are empty below stand for it as well,
// which is as right, since all that is there is here.
double OctreePool::unseen_key(const FoundSource& found, double tau) {
  // A copy that is not walked has no other source that could reach the threshold.
  if (most_missed_ < tau || found.copy == kNoCopy) return 0;
  const Copy& copy = copies_[found.copy];
  const Vec3 position_m = copy.placement.inside(Vec3(found.source->position_m));
  const PageEntry* entry = copy.tree;
  OctreeCube cube = OctreeCube::around(Vec3(entry->low_m), Vec3(entry->high_m));
  while (entry != nullptr) {
    if (bound(*entry, copy, entry->highest_key) < tau * copy.to_threshold) return 0;
    const ResidentPage* const page = loader_.find(*entry);
    if (page == nullptr) return entry->highest_key * copy.placement.power;
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
  asked_ = false;
  shortlists_.expect(looked_for_);
  plan_ahead(soon);
  if (trees_.empty()) return;
  std::vector<WantedPage> wanted;
  for (const WantedPage& one : missed_)
    if (one.urgency >= tau && one.urgency > 0) wanted.push_back(one);
  wanted.insert(wanted.end(), nearly_.begin(), nearly_.end());
  asked_ = !wanted.empty();
  look_ahead(soon, tau);
  for (const WantedPage& one : soon_)
    if (!loader_.is_here(one.entry)) wanted.push_back(one);
  // Copies of one tree want the same pages.
  std::sort(wanted.begin(), wanted.end(), [](const WantedPage& a, const WantedPage& b) {
    if (a.entry.page.offset != b.entry.page.offset)
      return a.entry.page.offset < b.entry.page.offset;
    return a.needed != b.needed ? a.needed : a.urgency > b.urgency;
  });
  wanted.erase(std::unique(wanted.begin(), wanted.end(),
                           [](const WantedPage& a, const WantedPage& b) {
                             return a.entry.page.offset == b.entry.page.offset;
                           }),
               wanted.end());
  if (wanted.size() > kMostAsked) {
    std::nth_element(wanted.begin(), wanted.begin() + kMostAsked, wanted.end(),
                     [](const WantedPage& a, const WantedPage& b) {
                       return a.needed != b.needed ? a.needed : a.urgency > b.urgency;
                     });
    wanted.resize(kMostAsked);
  }
  loader_.ask(std::move(wanted));
}

bool OctreePool::complete() { return !asked_ || !loader_.wait(); }

}  // namespace clamor
