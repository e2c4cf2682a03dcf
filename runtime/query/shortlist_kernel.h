// shortlist_kernel.h: which sources of a shortlist are loud enough here and now, 16 at a time.
//
// The signals' shares of their loudest (signal_weights.h) are tabulated once per keyframe, by the
// delay they are heard at. A source is first asked for its ceiling, which holds near by, then for
// that times the share of its signal's loudest band, then for the share of its own mix of bands
// (band_mix.h), then for what is known to be left of that behind what stands in the way
// (occlusion_upper_bounds.h), and only then for its ceiling at this very place: what that is made
// of lies elsewhere, and most are not asked for it.
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
#include "runtime/query/source_culler.h"

namespace clamor {

// 16 sources of a shortlist, each number of all of them side by side: what is asked of all of them
// in each keyframe.
struct alignas(64) ShortlistBlock {
  static constexpr std::size_t kEntries = kCullBlock;
  using Row = CullBlock::Row;
  Row ceiling{};  // wherever the list holds; below 0: none
  Row delay_s{};  // to where the listener was
  std::array<std::uint32_t, kEntries> signal{};
  std::array<std::uint32_t, kEntries> source{};  // index in the page
  std::array<BandMix, kEntries> mix{};
};

// What is asked only of those that are loud enough by that: one line of memory each.
struct alignas(64) SourceShape {
  Vec3f position_m{};  // seen from where the listener was when the list was made
  Vec3f normal{}, mirror{};
  float radius2_m2 = 0, diffuse = 0, bounce = 0, lobe = 0, fall = 0;  // as in CullBlock
  float slope = 0;                                                    // -1: an emitter
  float boost = 0;                                                    // at full strength, less 1
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

// Those of some lists that are loud enough, side by side.
struct AudibleEntries {
  std::vector<std::uint32_t> entry;  // where in the list
  std::vector<float> share;          // of what it is when all bands are at their loudest,
  std::vector<float> known;          // and what of that is known to get past what is in the way

  struct Columns {
    std::uint32_t* entry;
    float *share, *known;
  };
  Columns from(std::size_t first) {
    return {entry.data() + first, share.data() + first, known.data() + first};
  }
  // For so many. Whole vectors are written, the last may go beyond them.
  void make_room(std::size_t count) {
    if (entry.size() >= count + kCullBlock) return;
    entry.resize(count + kCullBlock);
    share.resize(count + kCullBlock);
    known.resize(count + kCullBlock);
  }
};

// Writes those of a list that may reach `least` wherever the list holds; there must be room for
// all. Gives how many. `hidden` begins with the first source of the page.
std::size_t find_audible(std::span<const ShortlistBlock> blocks, float least,
                         const LoudnessTable& shares, const OcclusionUpperBounds::Window& hidden,
                         const AudibleEntries::Columns& loud);

// Ceilings of priorities at any time, at one place and as far round it as `off_m`. `position_m` of
// these is the way to it from there.
void upper_bounds_at(std::span<const SourceShape> shapes, float off_m, float* ceilings);

}  // namespace clamor
