// priority_sample_reference.h: priority sampling by its definition, with a sort of all priorities.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/sampling/sampler.h"

namespace clamor::testing {

struct WeightedSource {
  std::uint64_t number;
  double weight;
  float u;  // the source's own random number in (0, 1]
  double priority() const { return weight / u; }
};

// Power scales by number, of the `voices` sources with the highest priority weight / u. A scale is
// max(1, tau / weight), with tau the highest priority of the others.
inline std::map<std::uint64_t, double> reference_sample(std::vector<WeightedSource> all,
                                                        std::size_t voices) {
  std::erase_if(all, [](const WeightedSource& one) { return !(one.weight > 0); });
  std::sort(all.begin(), all.end(), [](const WeightedSource& a, const WeightedSource& b) {
    return a.priority() != b.priority() ? a.priority() > b.priority() : a.number < b.number;
  });
  const double tau = all.size() > voices ? all[voices].priority() : 0;
  std::map<std::uint64_t, double> choice;
  for (std::size_t i = 0; i < std::min(voices, all.size()); ++i)
    choice[all[i].number] = std::max(1.0, tau / all[i].weight);
  return choice;
}

inline void expect_sample(std::span<const SampledSource> sample,
                          const std::map<std::uint64_t, double>& expected, double tolerance) {
  ASSERT_EQ(sample.size(), expected.size());
  for (const SampledSource& chosen : sample) {
    const auto found = expected.find(chosen.number);
    ASSERT_NE(found, expected.end()) << chosen.number;
    ASSERT_NEAR(chosen.power_scale / found->second, 1, tolerance) << chosen.number;
  }
}

}  // namespace clamor::testing
