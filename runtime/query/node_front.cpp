#include "runtime/query/node_front.h"

#include <algorithm>
#include <utility>

#include "runtime/propagation/tolerances.h"

namespace clamor {

using namespace query;

void NodeFront::start(const ValidityRegion& region, const PageShortlists& lists) {
  clear();
  traversal_.start(region);
  generation_ = lists.generation();
}

void NodeFront::find_lists(PageShortlists& lists) {
  if (generation_ == lists.generation()) return;
  generation_ = lists.generation();
  for (Node& node : nodes_)
    if (node.page != nullptr) node.list = lists.list_of(node.at.first);
  forget_results();
}

void NodeFront::clear() {
  traversal_.reset();
  nodes_.clear();
  results_.clear();
  missing_ = 0;
}

bool NodeFront::grow(PageLoader& loader, PageShortlists& lists) {
  OctreeTraversal::Node at;
  if (!traversal_.next(at)) return false;
  PageLoader::CacheEntry* const cached = loader.find_entry(*at.entry);
  const ResidentPage* const page = cached != nullptr ? cached->resident() : nullptr;
  if (page == nullptr) {
    ++missing_;
    nodes_.push_back({at, nullptr, nullptr, nullptr, 0});
    results_.emplace_back();
    return true;
  }
  if (at.entry->source_count > 0) {
    nodes_.push_back({at, page, cached, page->sources.data(), lists.list_of(at.first)});
    results_.emplace_back();
  }
  if (at.entry->sources_below > at.entry->source_count) traversal_.expand(at, *page);
  if (nodes_.size() > kMaxFrontNodes) clear();
  return true;
}

std::span<const std::uint32_t> NodeFront::find_due(const ValidityRegion& query) {
  due_.clear();
  for (std::uint32_t n = 0; n < results_.size(); ++n)
    if (!results_[n].region.contains(query)) due_.push_back(n);
  return due_;
}

void NodeFront::add_arrived(PageLoader& loader, PageShortlists& lists) {
  if (missing_ == 0) return;
  const std::span<const std::uint64_t> arrived = loader.arrived();
  const bool was_growing = is_growing();
  for (std::size_t n = 0; n < nodes_.size();) {
    const Node& node = nodes_[n];
    if (node.page != nullptr ||
        !std::binary_search(arrived.begin(), arrived.end(), node.at.entry->page.offset)) {
      ++n;
      continue;
    }
    traversal_.resume(node.at);
    --missing_;
    nodes_[n] = nodes_.back();
    results_[n] = results_.back();
    nodes_.pop_back();
    results_.pop_back();
  }
  if (!was_growing)
    while (grow(loader, lists)) {
    }
}

void NodeFronts::refresh() {
  if (loader_.has_dropped()) {
    forget();
    pause_ = kFrontPause_keyframes;
  }
  current_.add_arrived(loader_, lists_);
  next_.add_arrived(loader_, lists_);
}

std::size_t NodeFronts::prepare(const ValidityRegion& query, const Vec3& next_place) {
  if (context_.trees.size() != 1) return 0;
  if (pause_ > 0) {
    --pause_;
    return 0;
  }
  if (!next_.is_started()) {
    const double margin_m = current_.region().radius_m / 4;
    if (holds({next_place, margin_m, kFrontRenewThreshold * query.threshold,
               query.until_s + kMinFrontDuration_s}))
      return 0;
    const Vec3 path_m = next_place - query.centre;
    const double radius_m = std::max(kFrontRadiusPerPath * length(path_m), kMinFrontRadius_m);
    if (radius_m > kMaxFrontRadius_m) return 0;
    next_.start({query.centre + path_m / 2.0, radius_m, kFrontThreshold * lists_.lowest_threshold(),
                 context_.bounds.until_s()},
                lists_);
  }
  return kMinFrontSteps + current_.nodes().size() / kFrontStepShare;
}

bool NodeFronts::grow() {
  if (next_.grow(loader_, lists_)) return true;
  if (next_.is_started() && !next_.is_growing()) {
    std::swap(current_, next_);
    next_.clear();
  }
  return false;
}

}  // namespace clamor
