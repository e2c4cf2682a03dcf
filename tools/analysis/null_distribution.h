// null_distribution.h: how far two exact renderings of one texture are apart by chance.
//
// A crowd, rain or a late tail is a random texture: nobody can hold its waveform, and its measures
// differ from one exact rendering to the next. So the yardstick for an approximation is not zero
// but the 95th percentile of what chance alone does: exact renderings with other random phases. An
// approximation of the same statistics lies inside it 95 times in 100.
//
// Who has a scene renders it again: `difference_of_roll(j)` = compare(exact, render with phases
// j). Then the test is exact: an approximation as good as another rendering fails one time in
// 20. Who has only the recording takes pairs of rolls of a RandomTexture of it. That is right
// for steady noise, and too strict where few signals make the texture: in
// assets/levels/stadium.glb 16 416 fans play 13 loops with phases within 0.3 s, so what
// interferes at one frequency interferes all the time. Exact renderings of bakes with other
// seeds were up to 1 LU and, in one ERB band, 6 to 12 dB apart, where steady noise would be 0.2
// LU and 1.3 dB.
//
// Each measure is judged on its own: of ten, at least one lies beyond in four of ten comparisons of
// exact renderings, were they independent.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "tools/analysis/sound_comparison.h"

namespace clamor {

class NullDistribution {
 public:
  // One list of differences per roll, the same measures in the same order; at least 19 rolls, the
  // fewest that have a 95th percentile.
  explicit NullDistribution(const std::vector<std::vector<Difference>>& rolls);

  // The Difference::size() of a measure that 95 of 100 rolls do not exceed: of n sizes in order,
  // the one numbered 0.95 (n + 1), rounded up, so that an exact rendering fails 1 time in 20, not
  // more.
  double size_95(Measure measure) const;

  std::size_t count() const { return count_; }

 private:
  std::size_t count_ = 0;
  std::vector<double> size_95_;  // by Measure
};

inline constexpr int kMinRolls = 19;

// difference_of_roll(0 ... count - 1), on all cores; what it gives may depend on the roll alone.
NullDistribution null_distribution(
    int count,
    const std::function<std::vector<Difference>(std::uint32_t roll)>& difference_of_roll);

}  // namespace clamor
