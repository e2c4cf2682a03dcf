// priority_estimates.h: tests estimates of sums for bias and variance.
#pragma once

#include <cmath>

#include <gtest/gtest.h>

namespace clamor::testing {

// Estimates from many samples of k sources, each relative to the sum of all sources.
class PriorityEstimates {
 public:
  void add(double ratio) {
    sum_ += ratio;
    squares_ += ratio * ratio;
    ++count_;
  }

  // Expects a mean within three standard errors of the true value and a relative variance of at
  // most 1 / (k - 1) (Duffield, Lund, Thorup).
  void expect_unbiased(double k) const {
    const double mean = sum_ / count_;
    const double deviation = std::sqrt(squares_ / count_ - mean * mean);
    EXPECT_NEAR(mean, 1, 3 * deviation / std::sqrt(count_));
    EXPECT_LE(deviation, 1 / std::sqrt(k - 1.0));
  }

 private:
  double sum_ = 0, squares_ = 0;
  int count_ = 0;
};

}  // namespace clamor::testing
