// octree_pool_query.cpp: how OctreePool finds the sources above a threshold.
#include <algorithm>
#include <array>
#include <cassert>
#include <limits>

#include "runtime/propagation/tolerances.h"
#include "runtime/query/octree_pool.h"

namespace clamor {

using namespace query;

bool OctreePool::find_above(double threshold, std::size_t max_count,
                            std::vector<FoundSource>& found) {
  assert((stage_ == Stage::kBegun || stage_ == Stage::kQueried) && "begin() comes first");
  stage_ = Stage::kQueried;
  query_ = {keyframe().place_m(), 0, threshold, query_.until_s};
  placed_count_ = 0;
  pending_.clear();
  requests_.begin_query();
  const bool all =
      fronts_.holds(query_) ? find_in_front(max_count, found) : find_by_traversal(max_count, found);
  if (!all) return false;
  test_pending(found);
  threshold_ = threshold;
  return found.size() <= max_count && !is_exhausted();
}

bool OctreePool::find_by_traversal(std::size_t max_count, std::vector<FoundSource>& found) {
  fronts_.current().forget_results();  // shortlists are made anew for this place
  const bool is_unlimited = max_count > kMaxPlacedSources;
  traversal_.start(query_);
  for (OctreeTraversal::Node node; traversal_.next(node);) {
    spend(WorkBudget::kNode);
    ++totals_.visited;
    const ResidentPage* const page =
        loader_.use(*node.entry, node.bound / traversal_.frame(node.frame).to_threshold);
    if (page == nullptr) {
      note_missing(node, node.bound);
      continue;
    }
    if (node.entry->source_count > 0) visit_page(node, *page, found);
    if (is_unlimited && placed_count_ >= kMaxPlacedSources) context_.steps_left = 0;
    if (found.size() > max_count || is_exhausted()) return false;
    // The page itself may be far away in memory, and most are leaves.
    if (node.entry->sources_below == node.entry->source_count) continue;
    traversal_.expand(node, *page);
    for (const OctreeTraversal::DistantInstance& distant : traversal_.distant_instances())
      add_distant(distant, found);
  }
  return true;
}

void OctreePool::visit_page(const OctreeTraversal::Node& node, const ResidentPage& page,
                            std::vector<FoundSource>& found) {
  const Frame& frame = traversal_.frame(node.frame);
  const double threshold = query_.threshold * frame.to_threshold;
  const bool has_representative =
      node.representative_key > 0 && page.highest_key_in == ResidentPage::HighestKeyIn::kSource;
  // The key of a representative is the instance's, which its shortlist does not know.
  if (has_representative) {
    const std::uint32_t signal =
        context_.maps.signal(frame.map, context_.radiation.signal(page.sources[0]));
    add_source(node, page.sources[0], 0,
               {0, 0, signal, std::numeric_limits<double>::infinity(),
                context_.radiation.late_boost().at(page.sources[0].delay_s)},
               threshold, node.representative_key, found);
  }
  const std::uint32_t list = shortlists_.list_of(node.first);
  const ShortlistPage shortlist_page{page.sources,
                                     *node.entry,
                                     {frame.place, 0, threshold, query_.until_s},
                                     frame.is_instance ? &frame.placement : nullptr,
                                     context_.maps,
                                     frame.map,
                                     frame.error_m};
  if (!shortlists_.holds(list, shortlist_page.query))
    totals_.tested += shortlists_.renew(list, shortlist_page);
  if (!shortlists_.is_empty(list))
    add_pending({node, page.sources.data(), list, threshold, has_representative}, found);
}

bool OctreePool::find_in_front(std::size_t max_count, std::vector<FoundSource>& found) {
  NodeFront& front = fronts_.current();
  traversal_.take_frames(front.traversal(), query_.centre);
  const std::span<const NodeFront::Node> nodes = front.nodes();
  const std::span<NodeFront::Result> results = front.results();
  const std::span<const std::uint32_t> due = front.find_due(query_);
  spend(WorkBudget::kFrontNode * due.size());
  for (std::size_t d = 0; d < due.size(); ++d) {
    if (d + kPrefetchNodes < due.size()) prefetch(nodes[due[d + kPrefetchNodes]]);
    results[due[d]] = test_front_node(nodes[due[d]]);
    if (is_exhausted()) return false;
  }
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (results[n].is_empty) continue;
    loader_.use(*nodes[n].cached, nodes[n].at.bound);
    add_pending({nodes[n].at, nodes[n].sources, nodes[n].list, query_.threshold, false}, found);
    if (found.size() > max_count || is_exhausted()) return false;
  }
  return true;
}

// Most of the time that a node takes is waiting for memory.
void OctreePool::prefetch(const NodeFront::Node& node) const {
  prefetch_to_read(node.at.entry, sizeof(PageEntry));
  if (node.page == nullptr) return;
  shortlists_.prefetch(node.list);
  __builtin_prefetch(&node.page->sources);
}

NodeFront::Result OctreePool::test_front_node(const NodeFront::Node& node) {
  const PageEntry& entry = *node.at.entry;
  if (node.at.bound < query_.threshold) {
    ValidityRegion region = fronts_.current().region();
    region.threshold = node.at.bound * (1 + kEmptyNodeSlack);
    return {region, true};
  }
  if (node.page == nullptr || !shortlists_.holds(node.list, query_)) {
    const double upper_bound = context_.bounds.bound(entry, entry.highest_key, query_.centre);
    if (!(upper_bound > 0 && upper_bound >= query_.threshold)) {
      const double near_by =
          context_.bounds.bound(entry, entry.highest_key, query_.centre, kEmptyNodeRadius_m);
      return {{query_.centre, kEmptyNodeRadius_m, near_by * (1 + kEmptyNodeSlack),
               context_.bounds.until_s()},
              true};
    }
    if (node.page == nullptr) {
      loader_.use(entry, upper_bound);  // counts it as late
      note_missing(node.at, upper_bound);
      return {};
    }
    const ShortlistPage page{node.page->sources, entry, query_, nullptr, context_.maps};
    totals_.tested += shortlists_.renew(node.list, page);
    ++totals_.visited;
    spend(WorkBudget::kNode);
  }
  return {shortlists_.region(node.list), shortlists_.is_empty(node.list)};
}

void OctreePool::note_missing(const OctreeTraversal::Node& node, double bound) {
  const Frame& frame = traversal_.frame(node.frame);
  const double of_any = traversal_.bound(*node.entry, frame, node.entry->highest_key);
  requests_.add_missing(*node.entry, bound / frame.to_threshold,
                        std::max(bound, of_any) / frame.to_threshold);
}

void OctreePool::add_pending(const Pending& page, std::vector<FoundSource>& found) {
  totals_.tested += shortlists_.use(page.list);
  pending_.push_back(page);
  if (pending_.size() == kPendingPages) test_pending(found);
}

void OctreePool::test_pending(std::vector<FoundSource>& found) {
  std::array<PageShortlists::Test, kPendingPages> tests;
  for (std::size_t p = 0; p < pending_.size(); ++p) {
    const Frame& frame = traversal_.frame(pending_[p].node.frame);
    tests[p] = {pending_[p].list, frame.place, pending_[p].threshold, frame.error_m};
  }
  shortlists_.test(std::span(tests).first(pending_.size()),
                   [&](const PageShortlists::Passed& passed) {
                     const Pending& page = pending_[passed.test];
                     if (page.skips_first && passed.index == 0) return;
                     add_source(page.node, page.sources[passed.index], passed.index, passed,
                                page.threshold, 0, found);
                   });
  pending_.clear();
}

void OctreePool::add_source(const OctreeTraversal::Node& node, const Source& stored,
                            std::size_t index, const PageShortlists::Passed& passed,
                            double threshold, double key, std::vector<FoundSource>& found) {
  const Frame& frame = traversal_.frame(node.frame);
  const BoostedBound boosted(passed.boost, frame.is_instance ? 0 : context_.bounds.late_boost(),
                             passed.upper_bound);
  if (boosted.upper_bound < threshold) return;
  const Source* const source = frame.is_instance ? place(stored, frame.placement, key) : &stored;
  if (source == nullptr) return;
  SourcePage::prefetch(stored);  // to be weighed
  spend(WorkBudget::kFound);
  found.push_back({source, node.first + index, passed.signal, node.frame, boosted.boost,
                   boosted.upper_bound / frame.to_threshold});
}

void OctreePool::add_distant(const OctreeTraversal::DistantInstance& distant,
                             std::vector<FoundSource>& found) {
  ++totals_.representatives;
  const InstanceRepresentative& one = *distant.representative;
  const Placement placement = within(distant.placement, one.placement);
  const Source* const source =
      place(one.source, placement, distant.representative_key / one.placement.power);
  if (source == nullptr) return;
  spend(WorkBudget::kFound);
  found.push_back({source, distant.first + one.number, distant.signal, kNoFrame, 1, distant.bound});
}

// Places a source of an instance; null where a forged file names a missing emitter. A positive
// `key` marks the representative, whose permanent number follows from it.
const Source* OctreePool::place(const Source& stored, const Placement& placement, double key) {
  if (std::uint64_t{stored.emitter} + placement.emitters >= context_.radiation.emitter_count())
    return nullptr;
  if (placed_count_ == placed_.size()) placed_.emplace_back();
  Source& source = placed_[placed_count_++];
  source = placement.place(stored);
  if (key > 0) source.u = static_cast<float>(std::min(1.0, sum_of(stored.power) / key));
  return &source;
}

}  // namespace clamor
