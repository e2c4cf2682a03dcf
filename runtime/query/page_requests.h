// page_requests.h: the pages that a keyframe lacked and that the next half second will need.
//
// Threads: the sampler's alone.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "runtime/propagation/tolerances.h"
#include "runtime/streaming/page_loader.h"

namespace clamor {

class PageRequests {
 public:
  explicit PageRequests(PageLoader& loader) : loader_(loader) {}

  // A new query lacks nothing yet.
  void begin_query();
  // A page is missing in which priorities reach `bound`; `max_bound` counts for is_missing().
  void add_missing(const PageEntry& entry, double bound, double max_bound);
  bool any_missing() const { return !missing_.empty(); }
  // Is a source missing that could reach the threshold?
  bool is_missing(double threshold) const { return max_missing_ >= threshold; }

  void clear_ahead() { ahead_.clear(); }
  // Where only a traversal can tell: pages that are needed soon change slowly.
  bool is_look_ahead_due() { return ++look_aheads_ % query::kLookAheadPeriod == 1; }
  void add_ahead(const PageEntry& entry, double bound);

  // Requests all of these from the loader, the most important first.
  void send(double threshold);
  // True once the loader has all pages that the last query lacked; waits for them.
  bool wait() { return !lacked_any_ || !loader_.wait(); }

 private:
  PageLoader& loader_;
  std::vector<PageRequest> missing_, ahead_;
  double max_missing_ = -1;
  std::uint32_t look_aheads_ = 0;
  bool lacked_any_ = false;  // at the last send()
};

}  // namespace clamor
