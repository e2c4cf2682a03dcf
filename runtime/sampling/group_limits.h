// group_limits.h: limits how many sources of a group a sample may have.
//
// A group with more sources than its limit k' keeps the k' of highest priority a_i / u_i, with a_i
// an estimate of the weight w_i. With t the (k' + 1)-th priority, a source is in the sample only if
// u_i < a_i / t, so its power is scaled by t / a_i where that is more than the sampler's factor
// (sampler.h). The group stays unbiased in power, with the variance of fewer voices, and the voices
// that it gives up are free for others.
//
// Threads: the sampler's.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

namespace clamor {

class GroupLimits {
 public:
  // Group 0 has no limit.
  void set(std::uint16_t group, std::size_t max_voices) {
    if (group >= groups_.size()) groups_.resize(group + std::size_t{1});
    groups_[group].limit = max_voices;
  }
  bool any() const { return !groups_.empty(); }

  // Call begin(), count() for all sources, and end(). A source is kept if its priority is above the
  // threshold() of its group.
  void begin() {
    for (Group& group : groups_) group.priorities.clear();
  }
  void count(std::uint16_t group, double priority) {
    if (group > 0 && group < groups_.size()) groups_[group].priorities.push_back(priority);
  }
  void end() {
    for (Group& group : groups_) {
      group.threshold = 0;
      if (group.priorities.size() <= group.limit) continue;
      const auto next = group.priorities.begin() + static_cast<std::ptrdiff_t>(group.limit);
      std::nth_element(group.priorities.begin(), next, group.priorities.end(), std::greater<>());
      group.threshold = *next;
    }
  }
  double threshold(std::uint16_t group) const {
    return group < groups_.size() ? groups_[group].threshold : 0;
  }

 private:
  struct Group {
    std::size_t limit = std::numeric_limits<std::size_t>::max();
    std::vector<double> priorities;  // of the sources
    double threshold = 0;
  };

  std::vector<Group> groups_;
};

}  // namespace clamor
