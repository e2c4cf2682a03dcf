// importance_sampling.h: k of n sources, each with a probability in proportion to its weight.
//
// (The paper, sections 3.3 and 3.4.) A sum over n sources is estimated from k of them: if source i
// is among them with probability P_i, then the sum over the chosen ones of x_i / P_i is on average
// the sum of all x_i, whatever the P_i are. It is near that every time when P_i grows with x_i.
//
// Where the paper's text slips, and what is done here:
//
// * Equation 3 has a factor n too many. n / k belongs to p_i = 1 with i drawn evenly; with p_i
//   normalised, as in equation 4, the sum over the k draws of x_i / (k p_i) has the right mean.
// * Equation 3 leaves out the delay r_i / v_s of equation 2. Ours is in the mixer, always.
// * "Standard deviation O(sigma_p / sqrt n)": the error falls with the square root of k, the number
//   of draws. n does not come into it.
// * Equation 1's a_i = 1 / r_i^2 is an intensity, and equation 2 multiplies a pressure by it. Here
//   weights are powers, or their square roots where amplitudes are estimated (strategies.h).
//
// Without replacement no source may be chosen twice, so k p_i > 1 cannot be had: such a source is
// chosen for sure, and the others share what is left (inclusion_probabilities).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/random.h"

namespace clamor {

// Random numbers for one drawing: a function of the seed and the number of the drawing alone.
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

// P_i = min(1, c w_i), with c such that they add up to k: k times equation 4, but for those that
// are certain. Weights are finite and not negative; where k or fewer are above zero, each of them
// is certain. Takes O(n log k).
std::vector<double> inclusion_probabilities(std::span<const double> weights, std::size_t k);

// A set of k (or as many as have P_i > 0), by ascending index, in which i is with probability P_i:
// the paper's divide and conquer (3.4). The list is halved again and again, and the samples are
// dealt to the halves in proportion to the probabilities they add up to. Samples are whole, so a
// half gets what it is due rounded up or down, at random such that each gets its due on average:
// that makes the P_i exact, which "proportional" alone does not. O(n).
std::vector<std::uint32_t> choose_without_replacement(std::span<const double> probabilities,
                                                      Draws& draws);

}  // namespace clamor
