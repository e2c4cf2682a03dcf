// importance_sampling.h: chooses k of n sources with probabilities in proportion to their weights.
//
// (The paper, sections 3.3 and 3.4.) A sum over n sources is estimated from k of them: if source i
// is chosen with probability P_i, the sum of x_i / P_i over the chosen ones has the mean of the sum
// of all x_i, for any P_i. The variance is small if P_i grows with x_i.
//
// Corrections to the paper's text:
//
// * Equation 3 has a factor n too many. n / k belongs to p_i = 1 with equal probabilities; with
//   normalised p_i, as in equation 4, the sum over the k draws of x_i / (k p_i) has the right mean.
// * Equation 3 leaves out the delay r_i / v_s of equation 2. Here the mixer always applies it.
// * "Standard deviation O(sigma_p / sqrt n)": the error falls with the square root of k, the number
//   of draws, and does not depend on n.
// * Equation 1's a_i = 1 / r_i^2 is an intensity, but equation 2 multiplies a pressure by it. Here
//   weights are powers, or their square roots where amplitudes are estimated (strategies.h).
//
// Without replacement no source may be chosen twice, so k p_i > 1 is not possible. Such a source is
// certain, and the others share the rest (inclusion_probabilities).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/random.h"

namespace clamor {

// Random numbers for one drawing, determined by the seed and the drawing's number.
class Draws {
 public:
  Draws(std::uint64_t seed, std::uint64_t drawing) : seed_(seed), drawing_(drawing) {}

  // Uniform in [0, 1).
  double next() {
    const auto use = static_cast<std::uint32_t>(Use::kStrategy);
    return unit(philox(seed_, {static_cast<std::uint32_t>(drawing_),
                               static_cast<std::uint32_t>(drawing_ >> 32), count_++, use})[0]);
  }

 private:
  std::uint64_t seed_, drawing_;
  std::uint32_t count_ = 0;
};

// P_i = min(1, c w_i) with c such that they add up to k: k times equation 4, except for certain
// sources. Weights must be finite and not negative; if at most k are positive, each of those is
// certain. O(n log k).
std::vector<double> inclusion_probabilities(std::span<const double> weights, std::size_t k);

// A set of k sources (or as many as have P_i > 0), sorted by index, that contains i with
// probability P_i: the paper's divide and conquer (3.4). The list is halved recursively, and the
// samples are divided in proportion to the halves' probabilities. The integer numbers are rounded
// at random so that each half gets its due on average, which makes the P_i exact; "proportional"
// alone does not. O(n).
std::vector<std::uint32_t> choose_without_replacement(std::span<const double> probabilities,
                                                      Draws& draws);

}  // namespace clamor
