// threshold_predictor.h: which threshold about as many sources reach as are wanted, by how it went.
#pragma once

#include <algorithm>
#include <cstddef>

namespace clamor {

class ThresholdPredictor {
 public:
  bool is_known() const { return threshold_ > 0; }
  // Were there no more than were wanted, in all that was looked at?
  bool starved() const { return starved_; }

  // The last one, lowered by as much as it may well have fallen since: by thrice the most that it
  // fell from one sample to the next of late.
  double next() const {
    if (starved_) return threshold_;
    return threshold_ * std::clamp(0.97 - 3 * changed_by_, kCaution * kCaution, 0.95);
  }

  // What one is lowered by that only so many reached. There are about as many more above it as it
  // is lower; a guess that is too low costs more than a second one.
  static double lowered(std::size_t reached, std::size_t wanted) {
    return std::clamp(0.9 * static_cast<double>(reached) / static_cast<double>(wanted),
                      kCaution * kCaution, 0.9);
  }

  // That many were wanted so far, and are from now on.
  void want(std::size_t before, std::size_t now) {
    threshold_ *= static_cast<double>(before) / static_cast<double>(now);
  }

  void was(double threshold, bool starved) {
    if (is_known()) changed_by_ = std::max(0.8 * changed_by_, 1 - threshold / threshold_);
    threshold_ = threshold;
    starved_ = starved;
  }

 private:
  // The last threshold lowered by this catches as many nearly always when a listener walks.
  static constexpr double kCaution = 0.8;

  double threshold_ = 0;
  double changed_by_ = 0.05;  // of late: a share of it
  bool starved_ = false;
};

}  // namespace clamor
