// shortlist_kernel.h: which sources of a shortlist are loud enough here and now, 16 at a time.
//
// The signals' shares of their loudest (signal_weights.h) are tabulated once per keyframe, by the
// delay they are heard at. A source is first asked for its ceiling, which holds near by, then for
// that times the share of its signal, then for its ceiling at this very place, then for what is
// known to be left of that behind what stands in the way (hidden_numbers.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/vec.h"
#include "runtime/field/signal_weights.h"
#include "runtime/octree/source_sieve.h"
#include "runtime/sight/hidden_numbers.h"

namespace clamor {

// 16 sources of a shortlist, each number of all of them side by side; directions of x, then y, then
// z. Positions are seen from where the listener was when the list was made.
struct alignas(64) ShortlistBlock {
  static constexpr std::size_t kEntries = kSieveBlock;
  using Row = SieveBlock::Row;
  Row ceiling{};  // wherever the list holds; below 0: none
  Row delay_s{};  // to where the listener was
  std::array<std::uint32_t, kEntries> signal{}, index{};
  std::array<Row, 3> position_m{}, normal{}, mirror{};
  Row radius2_m2{}, diffuse{}, lobe{}, fall{}, over_cos_i{};  // as in SieveBlock
  Row boost{};                                                // at full strength, less 1
};

// No less than the share of each signal around the moment that is heard with a delay.
class SharesNow {
 public:
  static constexpr float kPerS = 50;

  // Of delays up to `longest_s`, each of them off by up to `give_s`; longer ones have all.
  void tabulate(std::span<const LoudnessTrack::Seen> signals, float longest_s, float give_s);

  const float* data() const { return shares_.data(); }
  std::size_t row() const { return row_; }

 private:
  std::vector<float> shares_;  // by signal and delay; none where nothing changes
  std::size_t row_ = 0;        // delays of one
};

struct LoudEntry {
  std::uint32_t entry = 0;  // where in the list
  float ceiling = 0;        // of the priority at any time, here and nowhere else,
  float left = 1;           // and the share of it that is known to be left at most
};

// Writes those of a list that may reach `least` at `place`, seen from where the listener was; there
// must be room for all. Gives how many. `hidden` begins with the first source of the page.
std::size_t loud_now(std::span<const ShortlistBlock> blocks, const Vec3f& place, float least,
                     const SharesNow& shares, const HiddenNumbers::Near& hidden,
                     LoudEntry* entries);

}  // namespace clamor
