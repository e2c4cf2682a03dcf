#include "runtime/octree_pool.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace clamor {

namespace {

constexpr double kSoon_s = 0.5;          // pages are asked for so long before they sound
constexpr double kGiveInTime_s = 0.05;   // of delays rounded, and of moments
constexpr double kSlack = 1.0001;        // single precision of keys and bounds
constexpr double kGive_m = 0.002;        // quantised positions, 10 km from the origin
constexpr double kTurned = 1e-5;         // what turning and moving a copy's sources may round
constexpr std::size_t kMostFirst = 256;  // pages of a tree that are always here
constexpr std::size_t kMostAsked = 256;  // pages at a time
constexpr std::uint64_t kMostVisited = 1 << 20;  // nodes in a walk; only a forged file has more

}  // namespace

SignalWeights highest_over_copies(const SignalWeights& weights,
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

PageLoader::Fetch pages_of(const BakeFile& file, const SourceField& field,
                           const SignalWeights& ceilings) {
  return [&](const PageEntry& entry) -> PageLoader::Content {
    auto page = file.read_page(entry);
    if (!page.ok()) return page.error();
    return std::make_unique<const ResidentPage>(
        entry, SourcePage(field, ceilings.by_signal, std::move(page->sources)),
        std::move(page->links), file.trees());
  };
}

OctreePool::OctreePool(const SourceField& field, const SignalWeights& ceilings,
                       std::span<const PageEntry> trees,
                       std::span<const std::vector<std::uint32_t>> signal_maps, PageLoader& loader)
    : field_(field),
      trees_(trees),
      signal_maps_(signal_maps),
      ceilings_(ceilings),
      audible_(ceilings.by_signal),
      most_per_power_(kSlack * field.most_per_power(ceilings.by_signal)),
      loader_(loader),
      maps_(signal_maps.begin(), signal_maps.end()) {
  for (const PageEntry& top : trees) load_first_pages(top);
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
  if (ceilings_.steady() || trees_.empty()) return;
  const PageEntry& top = trees_.back();
  const Vec3 low(top.low_m), high(top.high_m);
  const double farthest_m = length(place - (low + high) / 2.0) + length(high - low) / 2 + kGive_m;
  const double longest_s =
      top.most_delay_s + farthest_m / field_.speed_of_sound_mps() + kGiveInTime_s;
  std::vector<Bands> audible;
  for (const LoudnessTrack& track : ceilings_.tracks)
    audible.push_back(track.most_between(time_s - longest_s - field_.latest_start_s(),
                                         time_s + kSoon_s - field_.earliest_start_s()));
  if (audible == audible_) return;
  audible_ = std::move(audible);
  SignalWeights weights;
  weights.by_signal = audible_;
  weights = highest_over_copies(weights, signal_maps_);
  most_per_power_ = kSlack * field_.most_per_power(weights.by_signal);
}

double OctreePool::bound(const PageEntry& entry, const Vec3& place, double highest_key) const {
  const Vec3 low(entry.low_m), high(entry.high_m);
  const Vec3 away = glm::max(glm::max(low - place, place - high), Vec3(0));
  const double near_m = std::max(length(away) - kGive_m, kEmitterRadius_m);
  const double bound = highest_key * most_per_power_ / (near_m * near_m);
  if (entry.cone_cos > -1) {
    // Seen from anywhere in the ball round the bounds, is the place outside the cone?
    const Vec3 way = place - (low + high) / 2.0;
    const double way_m = length(way), radius_m = length(high - low) / 2 + kGive_m;
    if (way_m > radius_m) {
      const double cos_axis = dot(way, Vec3(entry.cone_axis)) / way_m;
      const double widest =
          std::acos(static_cast<double>(entry.cone_cos)) + std::asin(radius_m / way_m) + 1e-3;
      if (widest < 3.141 && cos_axis < std::cos(widest)) return 0;
    }
  }
  return bound;
}

void OctreePool::add_steps(const Step& from, const ResidentPage& page, double threshold) {
  const bool leads = from.lead_key > 0;
  std::uint64_t first = from.first + from.entry->source_count;
  for (std::size_t c = 0; c < page.links.children.size(); ++c) {
    const PageEntry& child = page.links.children[c];
    std::uint32_t copy = from.copy;
    if (child.octant == kNoOctant) {  // an octree of its own
      copy = static_cast<std::uint32_t>(copies_.size());
      copies_.push_back(Copy(copies_[from.copy]));
      copies_.back().tree = &child;
    }
    const bool is_leader =
        leads && page.leader == ResidentPage::Leader::kChild && page.leading_child == c;
    steps_.push_back({&child, copy, first, is_leader ? from.lead_key : 0});
    first += child.sources_below;
  }
  if (!page.copies.empty()) add_copies(from, page, threshold);
}

// By descending keys, down to one that is too low wherever in the node it stands.
void OctreePool::add_copies(const Step& from, const ResidentPage& page, double threshold) {
  const Copy& outer = copies_[from.copy];  // a deque's elements stay where they are
  const double here = threshold * outer.to_threshold;
  const bool copy_leads = from.lead_key > 0 && page.leader == ResidentPage::Leader::kCopy;
  const double per_key = bound(*from.entry, outer.place, 1);
  for (std::size_t c = 0; c < page.copies.size(); ++c) {
    const ResidentCopy& copy = page.copies[c];
    const double key = copy_leads && c == 0 ? from.lead_key : copy.key;
    if (key * per_key < here) {
      if (copy_leads && c == 0) continue;
      break;
    }
    const Instance& instance = page.links.instances[copy.instance];
    const PageEntry& tree = trees_[instance.tree];
    const Vec3 place = copy.unturned * (outer.place - copy.offset_m);
    const double lead_key = key / copy.gain;
    const double scale = instance.scale;
    const double to_threshold =
        outer.to_threshold * scale * scale / std::max(copy.gain, 1e-300) * (1 - kTurned);
    if (bound(tree, place, lead_key) < threshold * to_threshold) continue;
    copies_.push_back({&tree, outer.placement.then(instance), place, to_threshold,
                       composed(outer.map, instance.signals), true});
    steps_.push_back(
        {&tree, static_cast<std::uint32_t>(copies_.size() - 1), from.first + copy.first, lead_key});
  }
}

template <class PageOf, class Visit>
bool OctreePool::walk(const Vec3& place, double threshold, const PageOf& page_of,
                      const Visit& visit) {
  copies_.clear();
  steps_.clear();
  if (trees_.empty()) return true;
  copies_.push_back({&trees_.back(), {}, place, 1, kNoMap, false});
  steps_.push_back({&trees_.back(), 0, 0, 0});
  for (std::uint64_t steps = 0; !steps_.empty(); ++steps) {
    if (steps == kMostVisited) return false;
    const Step step = steps_.back();
    steps_.pop_back();
    const Copy& copy = copies_[step.copy];
    // The representative's own key, which may be any, does not count in a copy.
    const double key = step.lead_key > 0 ? step.lead_key : step.entry->highest_key;
    const double most = bound(*step.entry, copy.place, key);
    if (most == 0 || most < threshold * copy.to_threshold) continue;
    const ResidentPage* const page = page_of(*step.entry, most / copy.to_threshold);
    if (!visit(step, page, most / copy.to_threshold)) return false;
    if (page != nullptr) add_steps(step, *page, threshold);
  }
  return true;
}

double OctreePool::highest(const Vec3& place) {
  if (trees_.empty()) return 0;
  const PageEntry& top = trees_.back();
  // Its cone may point away from the place, which makes a bound of 0.
  return std::max(bound(top, place, top.highest_key), 1e-30);
}

std::uint32_t OctreePool::composed(std::uint32_t outer, std::uint32_t inner) {
  if (inner == kSameSignals) return outer;
  if (outer == kNoMap) return inner;
  // The file's own maps come first, then those that were composed.
  if (outer == last_outer_ && inner == last_inner_) return last_map_;
  const auto next = static_cast<std::uint32_t>(maps_.size());
  const auto [known, is_new] = known_maps_.try_emplace({outer, inner}, next);
  if (is_new) {
    maps_.push_back(signal_maps_[inner]);
    for (std::uint32_t& signal : maps_.back()) signal = maps_[outer][signal];
  }
  last_outer_ = outer;
  last_inner_ = inner;
  last_map_ = known->second;
  return last_map_;
}

std::uint32_t OctreePool::signal_of(const Source& source, const Copy& copy) const {
  const std::uint32_t signal = field_.signal(source);
  return copy.map == kNoMap ? signal : maps_[copy.map][signal];
}

void OctreePool::add_source(const Step& step, const ResidentPage& page, std::size_t index,
                            bool leads, std::vector<FoundSource>& found) {
  const Source& stored = page.sources[index];
  if (!copies_[step.copy].moved) {
    found.push_back({&stored, step.first + index, field_.signal(stored), step.copy});
    return;
  }
  const Copy& copy = copies_[step.copy];
  Source source = copy.placement.place(stored);
  if (source.emitter >= field_.emitter_count()) return;  // of a forged file
  if (leads) {
    const double power = std::accumulate(stored.power.begin(), stored.power.end(), 0.0);
    source.u = static_cast<float>(std::min(1.0, power / step.lead_key));
  }
  placed_.push_back(source);
  found.push_back({&placed_.back(), step.first + index, signal_of(stored, copy), step.copy});
}

bool OctreePool::look(const Vec3& place, double threshold, std::size_t most,
                      std::vector<FoundSource>& found) {
  place_ = place;
  placed_.clear();
  missed_.clear();
  all_here_ = true;
  const auto use = [this](const PageEntry& entry, double urgency) {
    ++visited_;
    return loader_.use(entry, urgency);
  };
  const auto visit = [&](const Step& step, const ResidentPage* page, double urgency) {
    if (page == nullptr) {
      all_here_ = false;
      if (!loader_.has_failed(*step.entry)) missed_.push_back({urgency, *step.entry, true});
      return true;
    }
    const Copy& copy = copies_[step.copy];
    const bool leads = step.lead_key > 0 && page->sources.size() > 0 &&
                       page->leader == ResidentPage::Leader::kSource;
    if (leads) add_source(step, *page, 0, true, found);
    page->sources.pass(field_, copy.place, threshold * copy.to_threshold,
                       [&](std::size_t i, double ceiling) {
                         if (leads && i == 0) return;
                         const std::size_t before = found.size();
                         add_source(step, *page, i, false, found);
                         if (found.size() > before)
                           found.back().ceiling = ceiling / copy.to_threshold;
                       });
    return found.size() <= most;
  };
  return walk(place, threshold, use, visit);
}

// Down through the cubes that hold the source, to the first page that is missing and matters.
double OctreePool::unseen_key(const FoundSource& found, double tau) {
  if (all_here_) return 0;
  const Copy& copy = copies_[found.copy];
  const Vec3 position_m = copy.placement.inside(Vec3(found.source->position_m));
  const PageEntry* entry = copy.tree;
  OctreeCube cube = OctreeCube::around(Vec3(entry->low_m), Vec3(entry->high_m));
  while (entry != nullptr) {
    if (bound(*entry, copy.place, entry->highest_key) < tau * copy.to_threshold) return 0;
    const ResidentPage* const page = loader_.find(*entry);
    if (page == nullptr) return entry->highest_key * copy.placement.power;
    const std::size_t octant = cube.octant_of(position_m);
    entry = nullptr;
    for (const PageEntry& child : page->links.children)
      if (child.octant == octant) entry = &child;
    cube = cube.child(octant);
  }
  return 0;
}

void OctreePool::ask(const Vec3& soon, double tau) {
  asked_ = false;
  if (trees_.empty()) return;
  std::vector<WantedPage> wanted;
  for (const WantedPage& one : missed_)
    if (one.urgency >= tau && one.urgency > 0) wanted.push_back(one);
  asked_ = !wanted.empty();
  if (soon != place_)
    walk(
        soon, tau, [this](const PageEntry& entry, double) { return loader_.find(entry); },
        [&](const Step& step, const ResidentPage* page, double urgency) {
          if (page == nullptr && urgency > 0 && !loader_.has_failed(*step.entry))
            wanted.push_back({urgency, *step.entry, false});
          return true;
        });
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
