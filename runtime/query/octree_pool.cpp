#include "runtime/query/octree_pool.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "runtime/propagation/tolerances.h"
#include "runtime/streaming/page_fetch.h"

namespace clamor {

using namespace query;

PageLoader::Fetch page_fetch(const BakeFile& file, const RadiationModel& radiation,
                             const SignalWeights& weights) {
  return page_fetch(file, [&](const PageEntry& entry, OctreePage page) {
    return std::make_unique<const ResidentPage>(
        entry, SourcePage(radiation, weights.by_signal, std::move(page.sources)),
        std::move(page.links), file.trees());
  });
}

// --- A keyframe ---------------------------------------------------------------------------------

OctreePool::OctreePool(const RadiationModel& radiation, const SignalWeights& weights,
                       std::span<const PageEntry> trees,
                       std::span<const std::vector<std::uint32_t>> signal_maps, PageLoader& loader)
    : context_(radiation, weights, trees, signal_maps),
      loader_(loader),
      shortlists_(radiation, weights),
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

bool OctreePool::refresh() {
  stage_ = Stage::kRefreshed;
  const bool changed = loader_.begin_sample();
  if (changed) {
    update_representatives();
    fronts_.refresh();
  }
  return changed;
}

void OctreePool::begin(const QueryKeyframe& keyframe) {
  assert(stage_ == Stage::kRefreshed && "refresh() comes first");
  stage_ = Stage::kBegun;
  SourcePool::begin(keyframe);
  NodeBounds& bounds = context_.bounds;
  if (keyframe.time_s < query_.until_s || keyframe.late_boost != bounds.late_boost())
    fronts_.forget();
  query_.until_s = keyframe.time_s;
  context_.steps_left = kMaxSteps;
  bounds.begin(keyframe);
  shortlists_.begin(keyframe, bounds.max_share(), bounds.until_s());
  fronts_.find_lists();
}

bool OctreePool::is_exhausted() {
  spend(shortlists_.take_work() + std::exchange(context_.work, 0));
  return SourcePool::is_exhausted();
}

double OctreePool::upper_bound() {
  if (context_.trees.empty()) return 0;
  const PageEntry& top = context_.trees.back();
  // The emission cone of the top may point away from the place, which makes a bound of 0.
  return std::max(context_.bounds.bound(top, top.highest_key, keyframe().place_m()), 1e-30);
}

// --- What comes next ----------------------------------------------------------------------------

// Down through the cubes that hold the source, to the first page that is missing and matters. A
// child has the octants up to the next child's; empty ones among them count as its own, which is
// right, since everything in them is in memory.
double OctreePool::missing_key(const FoundSource& found, double threshold) {
  // No other source of an instance that was not traversed could reach the threshold.
  if (!requests_.is_missing(threshold) || found.frame == kNoFrame) return 0;
  const Frame& frame = traversal_.frame(found.frame);
  const Vec3 position_m = frame.placement.inside(Vec3(found.source->position_m));
  const PageEntry* entry = frame.tree;
  OctreeCube cube = OctreeCube::around(Vec3(entry->low_m), Vec3(entry->high_m));
  while (entry != nullptr) {
    if (traversal_.bound(*entry, frame, entry->highest_key) < threshold * frame.to_threshold)
      return 0;
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

void OctreePool::request_pages(double threshold) {
  assert(stage_ == Stage::kQueried && "find_above() comes first");
  stage_ = Stage::kIdle;
  shortlists_.add_threshold(threshold_);
  std::size_t steps =
      fronts_.prepare({query_.centre, 0, threshold_, query_.until_s}, keyframe().place_ahead_m());
  for (; steps > 0 && !is_exhausted() && fronts_.grow(); --steps) {
    spend(WorkBudget::kFrontStep);
    ++totals_.front_nodes;
  }
  if (context_.trees.empty()) return;
  find_pages_ahead(threshold);
  requests_.send(threshold);
}

// The pages that are missing at the place of the next half second: from the front if it reaches as
// far, else by a traversal every few keyframes, since they change slowly.
void OctreePool::find_pages_ahead(double threshold) {
  const Vec3 next_place = keyframe().place_ahead_m();
  const ValidityRegion query{next_place, 0, threshold, query_.until_s};
  const bool by_front = next_place != query_.centre && fronts_.holds(query);
  if (!by_front && !requests_.is_look_ahead_due() && next_place != query_.centre) return;
  requests_.clear_ahead();
  if (next_place == query_.centre) return;
  if (by_front) {
    for (const NodeFront::Node& node : fronts_.current().nodes()) {
      if (node.page != nullptr || node.at.bound < threshold) continue;
      const PageEntry& entry = *node.at.entry;
      const double bound = context_.bounds.bound(entry, entry.highest_key, next_place);
      if (bound >= threshold) requests_.add_ahead(entry, bound);
    }
    return;
  }
  traversal_.start(query);
  for (OctreeTraversal::Node node; traversal_.next(node) && !is_exhausted();) {
    spend(WorkBudget::kNode);
    if (const ResidentPage* const page = loader_.find(*node.entry))
      traversal_.expand(node, *page);
    else
      requests_.add_ahead(*node.entry, node.bound / traversal_.frame(node.frame).to_threshold);
  }
}

}  // namespace clamor
