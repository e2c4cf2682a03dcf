// hidden_numbers.h: how much is heard of sources at most, in four bits beside their numbers.
//
// Behind a wall there may be twice as many sources that would matter as before it, and more of
// which a little comes round its edges. A pool asks this before it looks at one any closer, so that
// those cost a few bits each and no more: what is known of a source is at most 1/2^step of its
// power, in steps of 3 dB, or nothing. That it is so must be asked again as the listener walks:
// numbers take turns, every fourth at a time, and those whose turn it is count as if nothing stood
// in the way.
//
// Threads: the sampler's alone.   Memory: 544 bytes per 1024 numbers any of which was dimmed.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace clamor {

class HiddenNumbers {
 public:
  static constexpr std::uint32_t kTurns = 4;
  static constexpr std::uint8_t kHeard = 0, kHidden = 15;  // the first step, and the last

  // The step of a share of the power: none less than what is left.
  static std::uint8_t step_of(float share) {
    if (!(share > 0)) return kHidden;
    const std::uint32_t exponent = std::bit_cast<std::uint32_t>(share) >> 23;
    return static_cast<std::uint8_t>(exponent >= 127 ? 0 : std::min(127 - exponent - 1, 14u));
  }

  // Of 1024 numbers in a row, which a page of the octree has about, so that they lie together.
  static constexpr std::uint64_t kRow = 1024;
  class Row {
   public:
    std::uint8_t step(std::uint64_t number) const {
      return static_cast<std::uint8_t>(steps_[number % kRow / 16] >> (4 * (number % 16)) & 15);
    }
    void prefetch(std::uint64_t number) const { __builtin_prefetch(&steps_[number % kRow / 16]); }

   private:
    friend class HiddenNumbers;
    std::array<std::uint64_t, kRow / 16> steps_{};
  };

  HiddenNumbers();

  void set(std::uint64_t number, std::uint8_t step);
  void clear();

  // The turn of others, or of all.
  void begin_keyframe(bool all) {
    turn_ = (turn_ + 1) % kTurns;
    all_ = all;
  }
  std::uint32_t turn() const { return turn_; }
  static std::uint32_t turn_of(std::uint64_t number) {
    return static_cast<std::uint32_t>(number % kTurns);
  }

  const Row& row_of(std::uint64_t number) const { return rows_[find(number / kRow).row]; }

  // How much is heard at most of one in that row, as long as it is not its turn.
  float most(const Row& row, std::uint64_t number) const {
    if (all_ || turn_of(number) == turn_) return 1;
    static constexpr auto kShares = [] {
      std::array<float, 16> shares{};
      for (std::size_t s = 0; s < kHidden; ++s) shares[s] = s == 0 ? 1 : shares[s - 1] / 2;
      return shares;
    }();
    return kShares[row.step(number)];
  }

 private:
  struct Slot {
    std::uint64_t key = 0;  // 1 + number / kRow; 0: free
    std::uint32_t row = 0;  // the first has nothing
  };
  static std::uint64_t hash_of(std::uint64_t key) {
    key *= 0x9e3779b97f4a7c15u;
    return key ^ (key >> 29);
  }
  const Slot& find(std::uint64_t key) const {
    for (std::uint64_t at = hash_of(key) >> 20;; ++at) {
      const Slot& here = slots_[at & (slots_.size() - 1)];
      if (here.key == key + 1 || here.key == 0) return here;
    }
  }

  std::vector<Slot> slots_;  // open addressing, a power of two
  std::vector<Row> rows_;
  std::uint32_t turn_ = 0;
  bool all_ = true;
};

}  // namespace clamor
