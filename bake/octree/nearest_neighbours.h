// nearest_neighbours.h: the nearest neighbours of a source, and the patch radius that follows.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace clamor {

// The number of neighbours that count, including the source itself.
inline constexpr std::size_t kNeighbours = 16;

// A bound on squared distances that holds for distances that are rounded otherwise.
inline float loosened(float distance_squared) {
  return distance_squared * 1.0001f + std::numeric_limits<float>::min();
}

// Collects the nearest of the neighbours that are added, in whatever order; of those at the same
// distance the weaker ones, so that the result depends on the neighbours alone.
class NearestNeighbours {
 public:
  void add(float distance_squared, double power) {
    std::size_t at = count_;
    if (full() && !is_before(distance_squared, power, kNeighbours - 1)) return;
    if (full())
      at = kNeighbours - 1;
    else
      ++count_;
    for (; at > 0 && is_before(distance_squared, power, at - 1); --at) {
      distance_squared_[at] = distance_squared_[at - 1];
      power_[at] = power_[at - 1];
    }
    distance_squared_[at] = distance_squared;
    power_[at] = power;
  }

  // The radius of a source with this power; at least one neighbour was added.
  float radius_m(double own_power) const {
    // Powers are summed in ascending order, because the order of equidistant neighbours does not
    // matter to them. Places without a neighbour add 0.
    std::array<double, kNeighbours> power = power_;
    std::sort(power.begin(), power.end());
    double sum = 0;
    for (const double of_one : power) sum += of_one;
    const double share = sum > 0 ? std::min(1.0, own_power / sum) : 0;
    const double farthest = distance_squared_[count_ - 1];
    return static_cast<float>(std::sqrt(farthest * share / 2));
  }

 private:
  bool full() const { return count_ == kNeighbours; }
  bool is_before(float distance_squared, double power, std::size_t i) const {
    return distance_squared != distance_squared_[i] ? distance_squared < distance_squared_[i]
                                                    : power < power_[i];
  }

  std::array<float, kNeighbours> distance_squared_{};
  std::array<double, kNeighbours> power_{};
  std::size_t count_ = 0;
};

}  // namespace clamor
