// null_distribution.h: how far two exact renderings of one texture differ by chance.
//
// A crowd, rain or a late tail is a random texture. Nobody can remember its waveform, and its
// measures vary from one exact rendering to the next. An approximation is therefore not judged
// against zero but against the 95th percentile of what chance does: exact renderings with other
// random phases. An approximation with the same statistics passes 95 times in 100.
//
// With a scene, render it again: `difference_of_roll(j)` = compare(exact, render with phases j).
// The test is then exact: an approximation as good as another rendering fails one time in 20. With
// only a recording, compare pairs of rolls of its RandomTexture. That is right for steady noise,
// but too strict if few signals make the texture. In assets/levels/stadium.glb 16 416 fans play 13
// loops with phases within 0.3 s, so interference at a frequency persists. There, exact renderings
// of bakes with other seeds differ by up to 1 LU and by 6 to 12 dB in an ERB band, where steady
// noise would differ by 0.2 LU and 1.3 dB.
//
// Each measure is judged separately. Of ten independent measures, at least one fails in four of ten
// comparisons of exact renderings.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "tools/analysis/sound_comparison.h"

namespace clamor {

class NullDistribution {
 public:
  // One list of differences per roll, with the same measures in the same order; at least 19 rolls,
  // the fewest that have a 95th percentile.
  explicit NullDistribution(const std::vector<std::vector<Difference>>& rolls);

  // The Difference::size() of a measure that 95 of 100 rolls do not exceed: of n sorted sizes,
  // number 0.95 (n + 1), rounded up, so that an exact rendering fails at most 1 time in 20.
  double size_95(Measure measure) const;

  std::size_t count() const { return count_; }

 private:
  std::size_t count_ = 0;
  std::vector<double> size_95_;  // by Measure
};

inline constexpr int kMinRolls = 19;

// Calls difference_of_roll(0 ... count - 1) on all cores; the result may depend on the roll only.
NullDistribution null_distribution(
    int count,
    const std::function<std::vector<Difference>(std::uint32_t roll)>& difference_of_roll);

}  // namespace clamor
