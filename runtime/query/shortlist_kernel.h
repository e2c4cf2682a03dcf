// shortlist_kernel.h: tests the sources of a shortlist for this moment and this place, 16 at a
// time.
//
// Per keyframe the loudness of each signal is tabulated by the delay with which it is heard, as a
// share of its maximum (signal_weights.h). A source is tested in steps, each of which reads more:
//
//   its upper bound wherever the list holds,
//   x the share of its signal's loudest band,
//   x the share for its own mix of bands (band_mix.h),
//   x the upper bound of its visibility (occlusion_upper_bounds.h),
//   and last its upper bound at this very place, from data that lies elsewhere in memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/vec.h"
#include "formats/bake_file/source_octree.h"
#include "runtime/occlusion/occlusion_upper_bounds.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/propagation/source_page.h"

namespace clamor {

// 16 sources of a shortlist, as structure of arrays: what every keyframe tests.
struct alignas(64) ShortlistBlock {
  using Row = CullBlock::Row;
  Row upper_bound{};  // of the priority at any time, wherever the list holds; negative: no source
  Row delay_s{};      // to the centre of the list's region
  std::array<std::uint32_t, kCullBlock> signal{};
  std::array<std::uint32_t, kCullBlock> source{};  // index in the page
  std::array<BandMix, kCullBlock> mix{};
};

// How loud each signal is around the moment that is heard now, as a share of its maximum: an upper
// bound, by the delay from the signal to the listener.
class LoudnessTable {
 public:
  static constexpr float kPerS = 50;  // entries per second of delay

  // At `time_s`, for delays up to `max_delay_s`, or fewer if there are many signals, each of which
  // is known up to `error_s`. The share of longer delays is 1, and so is that of all delays if
  // there are far too many signals.
  void tabulate(std::span<const LoudnessTrack> signals, double time_s, float max_delay_s,
                float error_s);

  const BandShares* data() const { return shares_.data(); }
  std::size_t row() const { return row_; }  // entries per signal; 0: all shares are 1

 private:
  std::vector<BandShares> shares_;  // by signal and delay
  std::size_t row_ = 0;
};

// The sources of some lists that passed, as structure of arrays.
struct AudibleEntries {
  std::size_t count = 0;
  std::vector<std::uint32_t> entry;  // index in the list
  std::vector<float> share;          // of the maximum loudness
  std::vector<float> known;          // stored upper bound of the visibility

  // Removes all, and makes room for so many and for the vector that is written beyond the last.
  void clear(std::size_t max_count) {
    count = 0;
    if (entry.size() >= max_count + kCullBlock) return;
    for (auto* const column : {&share, &known}) column->resize(max_count + kCullBlock);
    entry.resize(max_count + kCullBlock);
  }
};

// Appends those of a list whose priority may reach `threshold` wherever the list holds; there must
// be room for all. `occlusion` begins with the first source of the page.
void find_audible(std::span<const ShortlistBlock> blocks, float threshold,
                  const LoudnessTable& loudness, const OcclusionUpperBounds::Window& occlusion,
                  AudibleEntries& audible);

// Upper bounds of priorities at any time, within `error_m` of the place that the sources' positions
// are relative to. Reads and writes a vector beyond the last.
void upper_bounds_at(const SourceBound* sources, std::size_t count, float error_m,
                     float* upper_bounds);

}  // namespace clamor
