// priority_estimates.h: whether sums over samples are right.
#pragma once

#include <cmath>

#include <gtest/gtest.h>

namespace clamor::testing {

// Sums of many samples of k sources, each re the sum of all sources.
class PriorityEstimates {
 public:
  void add(double ratio) {
    sum_ += ratio;
    squares_ += ratio * ratio;
    ++count_;
  }

  // Within three standard errors of the truth; relative variance at most 1 / (k - 1) (Duffield,
  // Lund, Thorup).
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
