#include "tools/strategies/importance_sampling.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace clamor {

namespace {

// Sums of the probabilities over recursive halves of the list: node 1 is the whole list, and the
// halves of node i are 2i and 2i + 1. Added pairwise, so that a node's sum equals that of its
// halves.
class Halves {
 public:
  explicit Halves(std::span<const double> probabilities) {
    while (leaves_ < probabilities.size()) leaves_ *= 2;
    due_.assign(2 * leaves_, 0);
    possible_.assign(2 * leaves_, 0);
    for (std::size_t i = 0; i < probabilities.size(); ++i) {
      due_[leaves_ + i] = probabilities[i];
      possible_[leaves_ + i] = probabilities[i] > 0;
    }
    for (std::size_t node = leaves_; node-- > 1;) {
      due_[node] = due_[2 * node] + due_[2 * node + 1];
      possible_[node] = possible_[2 * node] + possible_[2 * node + 1];
    }
  }

  // The number of samples of the whole list.
  std::uint32_t whole() const {
    return std::min(static_cast<std::uint32_t>(std::llround(due_[1])), possible_[1]);
  }

  void deal(std::size_t node, std::uint32_t samples, Draws& draws,
            std::vector<std::uint32_t>& chosen) const {
    if (samples == 0) return;
    if (node >= leaves_) {
      chosen.push_back(static_cast<std::uint32_t>(node - leaves_));
      return;
    }
    const std::uint32_t left = to_the_left(node, samples, draws);
    deal(2 * node, left, draws, chosen);
    deal(2 * node + 1, samples - left, draws, chosen);
  }

 private:
  // The halves are due L and R samples with fractions l and r, and each gets its due rounded down
  // or up. If l + r < 1, at most one sample exceeds the integer parts, and it goes left with
  // probability l / (l + r). Otherwise at least one does, and a single one goes left with
  // probability (1 - r) / (2 - l - r). Averaged over the node's own samples, the left half is
  // rounded up with probability l.
  std::uint32_t to_the_left(std::size_t node, std::uint32_t samples, Draws& draws) const {
    const double left = due_[2 * node], right = due_[2 * node + 1];
    const double l = left - std::floor(left), r = right - std::floor(right);
    const auto low = static_cast<std::int64_t>(std::floor(left));
    const auto over = static_cast<std::int64_t>(samples) - low -
                      static_cast<std::int64_t>(std::floor(right));  // 0, 1 or 2
    std::int64_t dealt = low;
    if (over >= 2)
      ++dealt;
    else if (over == 1)
      dealt += draws.next() < (l + r < 1 ? l / (l + r) : (1 - r) / (2 - l - r));
    // Rounding of the sums must not assign a half more than it can hold.
    const auto count = static_cast<std::int64_t>(samples);
    const auto most = std::min<std::int64_t>(count, possible_[2 * node]);
    const auto least =
        std::max<std::int64_t>(0, count - static_cast<std::int64_t>(possible_[2 * node + 1]));
    return static_cast<std::uint32_t>(std::clamp(dealt, least, most));
  }

  std::size_t leaves_ = 1;
  std::vector<double> due_;
  std::vector<std::uint32_t> possible_;
};

}  // namespace

std::vector<double> inclusion_probabilities(std::span<const double> weights, std::size_t k) {
  std::vector<double> probabilities(weights.size(), 0);
  std::vector<double> above_zero;
  for (const double w : weights) {
    assert(w >= 0 && std::isfinite(w));
    if (w > 0) above_zero.push_back(w);
  }
  if (k == 0) return probabilities;
  // The heaviest are certain as long as their share of the remaining samples is 1 or more.
  double rest = std::accumulate(above_zero.begin(), above_zero.end(), 0.0);
  std::size_t certain = 0;
  if (above_zero.size() <= k) {
    certain = above_zero.size();
  } else {
    const auto heaviest = above_zero.begin() + static_cast<std::ptrdiff_t>(k);
    std::partial_sort(above_zero.begin(), heaviest, above_zero.end(), std::greater<>());
    while (certain < k && above_zero[certain] * static_cast<double>(k - certain) >= rest)
      rest -= above_zero[certain++];
    // Recompute the sum instead of subtracting, which would leave rounding errors.
    rest = std::accumulate(above_zero.begin() + static_cast<std::ptrdiff_t>(certain),
                           above_zero.end(), 0.0);
  }
  const double per_weight =
      certain < above_zero.size() ? static_cast<double>(k - certain) / rest : 0;
  // Sort only if some are uncertain.
  const double min_certain =
      certain == 0 || certain == above_zero.size() ? 0 : above_zero[certain - 1];
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0) continue;
    probabilities[i] =
        certain > 0 && weights[i] >= min_certain ? 1 : std::min(1.0, weights[i] * per_weight);
  }
  return probabilities;
}

std::vector<std::uint32_t> choose_without_replacement(std::span<const double> probabilities,
                                                      Draws& draws) {
  std::vector<std::uint32_t> chosen;
  if (probabilities.empty()) return chosen;
  const Halves halves(probabilities);
  chosen.reserve(halves.whole());
  halves.deal(1, halves.whole(), draws, chosen);
  return chosen;
}

}  // namespace clamor
