// threshold_predictor.h: predicts the k-th priority of the next sample from previous ones.
#pragma once

#include <algorithm>
#include <cstddef>

namespace clamor {

class ThresholdPredictor {
 public:
  bool is_known() const { return threshold_ > 0; }
  // Did the last search find too few sources?
  bool starved() const { return starved_; }

  // The last threshold, lowered by three times its largest recent fall from one sample to the next.
  double next() const {
    if (starved_) return threshold_;
    return threshold_ * std::clamp(0.97 - 3 * changed_by_, kCaution * kCaution, 0.95);
  }

  // Factor for a threshold that too few sources reached. Their number grows about as the threshold
  // falls; a guess that is too low costs more than a second one.
  static double lowering_factor(std::size_t reached, std::size_t wanted) {
    return std::clamp(0.9 * static_cast<double>(reached) / static_cast<double>(wanted),
                      kCaution * kCaution, 0.9);
  }

  // Adapts the prediction to another sample size k.
  void rescale(std::size_t from_k, std::size_t to_k) {
    threshold_ *= static_cast<double>(from_k) / static_cast<double>(to_k);
  }

  // Records the result of a search: the k-th priority, or the lowest threshold of a starved one.
  void observe(double threshold, bool starved) {
    if (is_known()) changed_by_ = std::max(0.8 * changed_by_, 1 - threshold / threshold_);
    threshold_ = threshold;
    starved_ = starved;
  }

 private:
  // While a listener walks, the k-th priority hardly ever falls by more in one sample.
  static constexpr double kCaution = 0.8;

  double threshold_ = 0;
  double changed_by_ = 0.05;  // largest recent fall, as a share
  bool starved_ = false;
};

}  // namespace clamor
