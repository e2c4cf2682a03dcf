#include "runtime/query/page_requests.h"

#include "runtime/propagation/tolerances.h"

namespace clamor {

void PageRequests::begin_query() {
  missing_.clear();
  max_missing_ = -1;
}

void PageRequests::add_missing(const PageEntry& entry, double bound, double max_bound) {
  max_missing_ = std::max(max_missing_, max_bound);
  if (!loader_.has_failed(entry)) missing_.push_back({bound, entry, true});
}

void PageRequests::add_ahead(const PageEntry& entry, double bound) {
  if (bound > 0 && !loader_.has_failed(entry)) ahead_.push_back({bound, entry, false});
}

void PageRequests::send(double threshold) {
  std::vector<PageRequest> wanted;
  for (const PageRequest& one : missing_)
    if (one.bound >= threshold && one.bound > 0) wanted.push_back(one);
  lacked_any_ = !wanted.empty();
  for (const PageRequest& one : ahead_)
    if (!loader_.is_here(one.entry)) wanted.push_back(one);
  const auto is_more_urgent = [](const PageRequest& a, const PageRequest& b) {
    return a.needed != b.needed ? a.needed : a.bound > b.bound;
  };
  // Instances of one tree want the same pages.
  std::sort(wanted.begin(), wanted.end(), [&](const PageRequest& a, const PageRequest& b) {
    return a.entry.page.offset != b.entry.page.offset ? a.entry.page.offset < b.entry.page.offset
                                                      : is_more_urgent(a, b);
  });
  const auto is_same = [](const PageRequest& a, const PageRequest& b) {
    return a.entry.page.offset == b.entry.page.offset;
  };
  wanted.erase(std::unique(wanted.begin(), wanted.end(), is_same), wanted.end());
  if (wanted.size() > query::kMaxRequests) {
    std::nth_element(wanted.begin(), wanted.begin() + query::kMaxRequests, wanted.end(),
                     is_more_urgent);
    wanted.resize(query::kMaxRequests);
  }
  loader_.request(std::move(wanted));
}

}  // namespace clamor
