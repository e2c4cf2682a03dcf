#include "runtime/query/octree_traversal.h"

#include <algorithm>
#include <cassert>

#include "runtime/propagation/tolerances.h"
#include "runtime/query/work_budget.h"

namespace clamor {

using namespace query;

namespace {

// A bound of 0 is that of a node without sources or that radiates away, for any threshold.
bool reaches(double upper_bound, double threshold) {
  return upper_bound > 0 && upper_bound >= threshold;
}

}  // namespace

void OctreeTraversal::start(const ValidityRegion& region) {
  assert(region.radius_m == 0 || context_->trees.size() == 1);
  reset();
  if (context_->trees.empty()) return;
  start(region, context_->trees.back(), 0);
  if (!reaches(stack_.back().bound, region.threshold)) stack_.clear();
}

void OctreeTraversal::start(const ValidityRegion& region, const PageEntry& top,
                            std::uint64_t first) {
  reset();
  region_ = region;
  Frame& level = frames_.emplace_back();
  level.tree = &top;
  level.place = region.centre;
  stack_.push_back({&top, 0, first, 0, bound(top, level, top.highest_key, region.radius_m)});
}

bool OctreeTraversal::next(Node& node) {
  if (stack_.empty() || context_->steps_left == 0) return false;
  --context_->steps_left;
  node = stack_.back();
  stack_.pop_back();
  return true;
}

void OctreeTraversal::expand(const Node& node, const ResidentPage& page) {
  distant_.clear();
  // A forged file may have instances in a tree of probes.
  if (!page.instances.empty() && !context_->trees.empty()) add_instances(node, page);
  add_children(node, page);
}

void OctreeTraversal::take_frames(const OctreeTraversal& other, const Vec3& place) {
  frames_ = other.frames_;
  for (Frame& frame : frames_) frame.place = place;
}

// The last child goes first onto the stack, so that nodes are visited by ascending numbers.
void OctreeTraversal::add_children(const Node& from, const ResidentPage& page) {
  const bool has_representative =
      from.representative_key > 0 && page.highest_key_in == ResidentPage::HighestKeyIn::kChild;
  const Frame frame = frames_[from.frame];
  const double threshold = region_.threshold * frame.to_threshold;
  std::uint64_t first = from.first + from.entry->source_count;
  const std::size_t before = stack_.size();
  for (std::size_t c = 0; c < page.links.children.size(); ++c) {
    const PageEntry& child = page.links.children[c];
    // In an instance the stored key of the representative, which may be any, does not count.
    const double representative_key =
        has_representative && page.highest_key_child == c ? from.representative_key : 0;
    const double key = representative_key > 0 ? representative_key : child.highest_key;
    const double upper_bound = bound(child, frame, key, region_.radius_m);
    if (reaches(upper_bound, threshold)) {
      std::uint32_t index = from.frame;
      if (child.octant == kNoOctant) {  // an octree of its own
        index = static_cast<std::uint32_t>(frames_.size());
        frames_.push_back(frame);
        frames_.back().tree = &child;
      }
      stack_.push_back({&child, index, first, representative_key, upper_bound});
    }
    first += child.sources_below;
  }
  std::reverse(stack_.begin() + static_cast<std::ptrdiff_t>(before), stack_.end());
}

// By descending keys, down to one that is too low wherever in the node its instance is.
void OctreeTraversal::add_instances(const Node& from, const ResidentPage& page) {
  const Frame outer = frames_[from.frame];
  const bool by_instance =
      from.representative_key > 0 && page.highest_key_in == ResidentPage::HighestKeyIn::kInstance;
  const double per_key = bound(*from.entry, outer, 1);
  for (std::size_t c = 0; c < page.instances.size() && context_->steps_left > 0; ++c) {
    --context_->steps_left;
    context_->work += WorkBudget::kInstance;
    const bool has_highest_key = by_instance && c == 0;
    const double key = has_highest_key ? from.representative_key : page.instances[c].key;
    if (key * per_key < region_.threshold * outer.to_threshold) {
      if (has_highest_key) continue;
      break;
    }
    add_instance(from, outer, page.links.instances[page.instances[c].instance], page.instances[c],
                 key);
  }
}

void OctreeTraversal::add_instance(const Node& from, const Frame& outer, const Instance& instance,
                                   const ResidentInstance& resident, double key) {
  const Placement& placement = resident.placement;
  Frame inner;
  inner.tree = &context_->trees[instance.tree];
  inner.place = placement.inside(outer.place);
  inner.placement.scale = outer.placement.scale * placement.scale;
  inner.is_instance = true;
  inner.to_threshold = outer.to_threshold * placement.scale * placement.scale /
                       std::max(placement.power, 1e-300) * (1 - kInstanceThresholdSlack);
  inner.error_m = kInstanceErrorPerM * length(region_.centre) / inner.placement.scale;
  const double representative_key = key / placement.power;
  const double threshold = region_.threshold * inner.to_threshold;
  const InstanceRepresentative* const representative = context_->representatives.of(instance.tree);
  const double rest_key = representative != nullptr ? representative->rest_key
                                                    : std::max<double>(representative_key, 0);
  const double rest_bound = bound(*inner.tree, inner, rest_key);
  const std::uint64_t first = from.first + resident.first;
  if (reaches(rest_bound, threshold)) {
    inner.placement = within(outer.placement, placement);
    inner.map = context_->maps.composed(outer.map, instance.signals);
    frames_.push_back(inner);
    const double upper_bound = bound(*inner.tree, inner, std::max(representative_key, rest_key));
    stack_.push_back({inner.tree, static_cast<std::uint32_t>(frames_.size() - 1), first,
                      representative_key, upper_bound});
  } else if (representative != nullptr) {
    const std::uint32_t signal = context_->maps.signal(
        context_->maps.composed(outer.map, instance.signals), representative->signal);
    const double upper_bound =
        context_->representatives.bound(*representative, context_->bounds.max_weights(signal),
                                        representative_key, inner.place, inner.placement.scale);
    if (reaches(upper_bound, threshold))
      distant_.push_back({representative, within(outer.placement, placement), signal, first,
                          representative_key, upper_bound / inner.to_threshold});
  }
}

}  // namespace clamor
