#include "tools/analysis/null_distribution.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <thread>

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
  std::atomic<std::uint32_t> next = 0;
  const auto work = [&] {
    for (std::uint32_t roll; (roll = next.fetch_add(1)) < rolls.size();)
      rolls[roll] = difference_of_roll(roll);
  };
  {
    std::vector<std::jthread> others;
    const unsigned cores = std::min(std::thread::hardware_concurrency(), unsigned(count));
    for (unsigned i = 1; i < cores; ++i) others.emplace_back(work);
    work();
  }
  return NullDistribution(rolls);
}

}  // namespace clamor
