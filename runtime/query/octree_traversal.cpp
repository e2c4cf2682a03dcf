// octree_traversal.cpp: OctreePool's way down, and what it leaves out.
#include <algorithm>
#include <cmath>

#include "runtime/query/octree_pool.h"

namespace clamor {

namespace {

constexpr double kLeadSlack = 1.0001;  // single precision
constexpr double kLeadGive_m = 0.003;  // and of positions

}  // namespace

bool OctreePool::walk(const Vec3& place, double threshold, const PageOf& page_of,
                      const Visit& visit, const Heard& heard) {
  copies_.clear();
  steps_.clear();
  if (trees_.empty()) return true;
  const PageEntry& top = trees_.back();
  copies_.push_back({&top, {}, place, 1, SignalMaps::kNone, false});
  if (const double most = bound(top, copies_[0], top.highest_key); most > 0 && most >= threshold)
    steps_.push_back({&top, 0, 0, 0, most});
  // What is beyond the steps of a keyframe is passed over as if it were not there: asked again with
  // another threshold it would be no less.
  while (!steps_.empty() && steps_left_ > 0) {
    --steps_left_;
    spend(WorkBudget::kNode);
    const Step step = steps_.back();
    steps_.pop_back();
    const ResidentPage* const page =
        page_of(*step.entry, step.most / copies_[step.copy].to_threshold);
    ValidityRegion quiet;
    quiet.give_m = -1;
    if (!visit(step, page, quiet)) return false;
    if (page == nullptr) continue;
    if (step.representative_key > 0) quiet.give_m = -1;
    // The page itself may be far away in memory, and most are leaves.
    if (step.entry->sources_below > step.entry->source_count) {
      if (!page->copies.empty()) {
        quiet.give_m = -1;
        add_copies(step, *page, threshold, heard);
        if (is_exhausted()) return false;
      }
      add_steps(step, *page, threshold, quiet);
    }
    if (quiet.give_m > 0)
      quiet_.set(CulledNodeCache::key_of(step.entry->page.offset, step.first), quiet);
  }
  return true;
}

// The last child first, so that nodes are visited by ascending numbers.
void OctreePool::add_steps(const Step& from, const ResidentPage& page, double threshold,
                           ValidityRegion& quiet) {
  const bool leads = from.representative_key > 0 && page.leader == ResidentPage::Leader::kChild;
  std::uint64_t first = from.first + from.entry->source_count;
  const std::size_t before = steps_.size();
  for (std::size_t c = 0; c < page.links.children.size(); ++c) {
    const PageEntry& child = page.links.children[c];
    // The representative's own key, which may be any, does not count in a copy.
    const double representative_key =
        leads && page.leading_child == c ? from.representative_key : 0;
    const double key = representative_key > 0 ? representative_key : child.highest_key;
    const Copy& copy = copies_[from.copy];
    const double most = bound(child, copy, key);
    const double least = threshold * copy.to_threshold;
    if (most > 0 && most >= least) {
      if (on_.culled_nodes && child.octant != kNoOctant && representative_key == 0)
        if (const ValidityRegion* known =
                quiet_.find(CulledNodeCache::key_of(child.page.offset, first))) {
          const ValidityRegion here = known->seen_from(copy.place);
          if (here.holds(least, time_s_)) {
            quiet.narrow(here);
            first += child.sources_below;
            continue;
          }
        }
      quiet.give_m = -1;
      std::uint32_t number = from.copy;
      if (child.octant == kNoOctant) {  // an octree of its own
        number = static_cast<std::uint32_t>(copies_.size());
        copies_.push_back(Copy(copy));
        copies_.back().tree = &child;
      }
      steps_.push_back({&child, number, first, representative_key, most});
    } else if (quiet.give_m > 0) {
      const double widely = bound(child, copy, key, quiet.give_m);
      if (widely < least || widely <= 0)
        quiet.threshold = std::max(quiet.threshold, widely * (1 + 1e-9));
      else
        quiet.give_m = -1;
    }
    first += child.sources_below;
  }
  std::reverse(steps_.begin() + static_cast<std::ptrdiff_t>(before), steps_.end());
}

// By descending keys, down to one that is too low wherever in the node it stands.
void OctreePool::add_copies(const Step& from, const ResidentPage& page, double threshold,
                            const Heard& heard) {
  const Copy outer = copies_[from.copy];
  const bool copy_leads = from.representative_key > 0 && page.leader == ResidentPage::Leader::kCopy;
  const double per_key = bound(*from.entry, outer, 1);
  for (std::size_t c = 0; c < page.copies.size() && steps_left_ > 0; ++c, --steps_left_) {
    spend(WorkBudget::kInstance);
    if (is_exhausted()) return;
    const ResidentInstance& copy = page.copies[c];
    const bool is_leader = copy_leads && c == 0;
    const double key = is_leader ? from.representative_key : copy.key;
    if (key * per_key < threshold * outer.to_threshold) {
      if (is_leader) continue;
      break;
    }
    const Instance& instance = page.links.instances[copy.instance];
    const Placement& stands = copy.placement;
    Copy inner;
    inner.tree = &trees_[instance.tree];
    inner.place = stands.inside(outer.place);
    inner.placement.scale = outer.placement.scale * stands.scale;
    inner.to_threshold = outer.to_threshold * stands.scale * stands.scale /
                         std::max(stands.power, 1e-300) * (1 - kTurned);
    inner.off_m = kOffPerM * length(place_) / inner.placement.scale;
    const double representative_key = key / stands.power, least = threshold * inner.to_threshold;
    const InstanceRepresentative* const lead =
        on_.representatives ? leads_.of(instance.tree) : nullptr;
    const double rest_key =
        lead != nullptr ? lead->rest_key : std::max<double>(representative_key, 0);
    const double most_of_rest = bound(*inner.tree, inner, rest_key);
    const std::uint64_t first = from.first + copy.first;
    if (most_of_rest > 0 && most_of_rest >= least) {
      inner.placement = within(outer.placement, stands);
      inner.map = maps_.composed(outer.map, instance.signals);
      inner.moved = true;
      copies_.push_back(inner);
      const double most = bound(*inner.tree, inner, std::max(representative_key, rest_key));
      steps_.push_back({inner.tree, static_cast<std::uint32_t>(copies_.size() - 1), first,
                        representative_key, most});
    } else if (lead != nullptr) {
      const std::uint32_t signal =
          maps_.signal(maps_.composed(outer.map, instance.signals), lead->signal);
      const double most =
          most_of_lead(*lead, signal, representative_key, inner.place, inner.placement.scale);
      if (most > 0 && most >= least)
        heard({lead, &outer, &copy, signal, first, representative_key}, most / inner.to_threshold);
    }
  }
}

// A ceiling of the representative's priority, all in its tree's space: its power and where it
// stands are known, its signal is, and the air's share in each band.
double OctreePool::most_of_lead(const InstanceRepresentative& lead, std::uint32_t signal,
                                double representative_key, const Vec3& place,
                                double to_level) const {
  const Vec3 way_m = place - lead.position_m;
  const double r_m = length(way_m);
  if (!lead.source.is_emitter && dot(way_m, lead.normal) < -1e-5 * r_m - kLeadGive_m) return 0;
  const double near_m = std::max(r_m - kLeadGive_m, lead.radius_m);
  const Bands left = air_transmittance(field_.air_loss_per_m(), near_m * to_level);
  const Bands& weights = audible_[signal];
  double sum = 0;
  for (std::size_t b = 0; b < kBandCount; ++b)
    sum += static_cast<double>(weights[b]) * lead.most[b] * left[b];
  return kLeadSlack * representative_key * sum / (near_m * near_m);
}

}  // namespace clamor
