// dice.h: random numbers for the generator: a seed and a count, so every run draws the same.
//
// Never draw twice in the arguments of one call: their order of evaluation is unspecified.
#pragma once

#include <cstdint>

#include "common/random.h"

namespace clamor::assets {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : seed_(seed) {}

  // Uniform in [0, 1).
  double unit() { return clamor::unit(philox(seed_, {count_++, 0, 0, 0})[0]); }

  double between(double low, double high) { return low + (high - low) * unit(); }

  // Mean 0, variance 1, and never beyond 6: the sum of twelve uniforms.
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += unit();
    return sum;
  }

 private:
  std::uint64_t seed_;
  std::uint32_t count_ = 0;
};

}  // namespace clamor::assets
