// threshold_history.h: the lowest threshold of late.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include "runtime/query/query_constants.h"

namespace clamor {

// Thresholds rise and fall with syllables: caches that are made at a high one would all be made
// anew at the next low one. A single fall, as where a door opens, is forgotten after a while.
class ThresholdHistory {
 public:
  void add(double threshold, std::uint32_t keyframe) {
    lowest_ = 0;
    share_ = 1;
    if (!(threshold > 0)) return;
    if (keyframe % query::kThresholdMemory_keyframes == 0)
      before_ = std::exchange(current_, threshold);
    current_ = std::min(current_, threshold);
    lowest_ = std::min(before_, current_);
    share_ = std::max(lowest_ / threshold, query::kMinRecentThreshold);
  }
  double lowest() const { return lowest_; }
  // The same as a share of the last threshold, a third at least.
  double share() const { return share_; }

 private:
  double lowest_ = 0, share_ = 1;
  double before_ = std::numeric_limits<double>::infinity();  // of some keyframes
  double current_ = before_;                                 // of those after them
};

}  // namespace clamor
