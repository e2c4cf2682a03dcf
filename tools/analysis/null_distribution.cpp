#include "tools/analysis/null_distribution.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/parallel_for.h"

namespace clamor {

NullDistribution::NullDistribution(const std::vector<std::vector<Difference>>& rolls)
    : count_(rolls.size()), size_95_(kMeasures.size(), NAN) {
  assert(rolls.size() >= static_cast<std::size_t>(kMinRolls));
  const double number = std::ceil(0.95 * (static_cast<double>(rolls.size()) + 1) - 1e-9);
  for (std::size_t i = 0; i < rolls.front().size(); ++i) {
    std::vector<double> sizes;
    for (const auto& roll : rolls) sizes.push_back(roll[i].size());
    std::sort(sizes.begin(), sizes.end());
    size_95_[static_cast<std::size_t>(rolls.front()[i].info->measure)] =
        sizes[static_cast<std::size_t>(number) - 1];
  }
}

double NullDistribution::size_95(Measure measure) const {
  return size_95_[static_cast<std::size_t>(measure)];
}

NullDistribution null_distribution(
    int count,
    const std::function<std::vector<Difference>(std::uint32_t roll)>& difference_of_roll) {
  std::vector<std::vector<Difference>> rolls(static_cast<std::size_t>(count));
  parallel_for(rolls.size(), 1, 0, [&](std::size_t roll, std::size_t) {
    rolls[roll] = difference_of_roll(static_cast<std::uint32_t>(roll));
  });
  return NullDistribution(rolls);
}

}  // namespace clamor
