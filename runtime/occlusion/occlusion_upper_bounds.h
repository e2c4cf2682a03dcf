// occlusion_upper_bounds.h: how much is heard of sources at most, in four bits beside their
// numbers.
//
// Behind a wall there may be twice as many sources that would matter as before it, and more of
// which a little comes round its edges. A pool asks this before it looks at one any closer, so that
// those cost a few bits each and no more: what is known of a source is at most 1/2^step of its
// power, in steps of 3 dB, or nothing. That it is so must be asked again as the listener walks:
// numbers take turns, every fourth at a time, and those whose turn it is count as if nothing stood
// in the way. Where that finds more than there are rays for (behind the stands of a stadium, every
// source there is), only every eighth counts so, or up to every 32nd, and what else is a fourth
// only as if 1/8 of it were heard, or up to 1/512: the loudest are asked as often.
//
// Threads: the sampler's alone.   Memory: 544 bytes per 1024 numbers any of which was dimmed.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "common/fibonacci_hash.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

class OcclusionUpperBounds {
 public:
  static constexpr std::uint32_t kTurns = 4, kMaxTurns = 32;  // powers of two
  static constexpr std::uint8_t kHeard = 0, kHidden = 15;     // the first step, and the last

  // The step of a share of the power: none less than what is left.
  static std::uint8_t step_of(float share) {
    if (!(share > 0)) return kHidden;
    const std::uint32_t exponent = std::bit_cast<std::uint32_t>(share) >> 23;
    return static_cast<std::uint8_t>(exponent >= 127 ? 0 : std::min(127 - exponent - 1, 14u));
  }

  // The most that a step stands for.
  static float share_of(std::uint32_t step) {
    static constexpr auto kShares = [] {
      std::array<float, 16> shares{};
      for (std::size_t s = 0; s < kHidden; ++s) shares[s] = s == 0 ? 1 : shares[s - 1] / 2;
      return shares;
    }();
    return kShares[step];
  }

  // Of 1024 numbers in a row, which a page of the octree has at most, so that they lie together:
  // eight to a word.
  static constexpr std::uint32_t kRow = 1024, kPerWord = 8;
  using Row = std::array<std::uint32_t, kRow / kPerWord>;

  // What a kernel needs to know how much is heard at most of the numbers from one on, in its row
  // and the next. Valid until the next set().
  struct Near {
    const std::uint32_t* words = nullptr;        // of all rows; null: nothing is dimmed
    std::int32_t first_word = 0, next_word = 0;  // where the row begins, and the next
    std::uint32_t first = 0;                     // the number, of its row
    std::uint32_t turn = 0, turns = kTurns;
    std::uint32_t ahead = 0;  // of turns, that count as well
    float in_turn = 1;

    // Of one of which so much is known to be heard.
    float most(std::uint32_t index, float known) const {
      const std::uint32_t since = first + index - turn;
      if (words == nullptr || (since & (turns - 1)) <= ahead) return 1;
      return (since & (kTurns - 1)) <= ahead ? std::max(known, in_turn) : known;
    }

    // Of half a row's numbers, as far as they are in this row.
    void prefetch() const {
      const std::uint32_t from = first / kPerWord;
      const std::uint32_t count = std::min(kRow / 2 / kPerWord, kRow / kPerWord - from);
      if (words != nullptr) prefetch_to_read(words + first_word + from, count * sizeof *words);
    }
  };

  OcclusionUpperBounds();

  void set(std::uint64_t number, std::uint8_t step);
  void clear();

  // The turn of others, or of all.
  void begin_keyframe(bool all) {
    turn_ = (turn_ + 1) % turns_;
    all_ = all;
  }
  // Every fourth number has the same turn; in it, every so many count in full.
  std::uint32_t turn() const { return turn_ % kTurns; }
  static std::uint32_t turn_of(std::uint64_t number) {
    return static_cast<std::uint32_t>(number % kTurns);
  }
  bool retests_all() const { return all_; }
  bool counts_in_full(std::uint64_t number) const { return all_ || number % turns_ == turn_; }
  std::uint32_t turns() const { return turns_; }

  // So many counted in full that would not have been found else; twice as many turns if that is
  // more than `most`, half as many where all of that would be less.
  void took(std::size_t counted, std::size_t most) {
    if (counted > most)
      turns_ = std::min(2 * turns_, kMaxTurns);
    else if (4 * counted < most)
      turns_ = std::max(turns_ / 2, kTurns);
  }

  // `ahead`: in so many keyframes to come as well.
  Near near(std::uint64_t first, std::uint32_t ahead = 0) const {
    const std::uint32_t row = find(first / kRow).row, next = find(first / kRow + 1).row;
    if (all_ || (row == 0 && next == 0)) return {};
    return {rows_.front().data(),
            static_cast<std::int32_t>(row * std::tuple_size_v<Row>),
            static_cast<std::int32_t>(next * std::tuple_size_v<Row>),
            static_cast<std::uint32_t>(first % kRow),
            turn_,
            turns_,
            ahead,
            in_turn()};
  }

  // How much is heard at most of one.
  float most(std::uint64_t number) const {
    const std::uint32_t word = rows_[find(number / kRow).row][number % kRow / kPerWord];
    return most(number, share_of(word >> (4 * (number % kPerWord)) & 15));
  }
  // The same of one of which so much is known to be heard.
  float most(std::uint64_t number, float known) const {
    if (counts_in_full(number)) return 1;
    return turn_of(number) == turn() ? std::max(known, in_turn()) : known;
  }

 private:
  // What a number counts as at least that is in turn, but not in full: 1/8 for twice the turns.
  float in_turn() const {
    const float share = static_cast<float>(kTurns) / static_cast<float>(turns_);
    return share * share * share;
  }

  struct Slot {
    std::uint64_t key = 0;  // 1 + number / kRow; 0: free
    std::uint32_t row = 0;  // the first has nothing
  };
  const Slot& find(std::uint64_t key) const {
    for (std::size_t at = fibonacci_hash(key);; ++at) {
      const Slot& here = slots_[at & (slots_.size() - 1)];
      if (here.key == key + 1 || here.key == 0) return here;
    }
  }

  std::vector<Slot> slots_;  // open addressing, a power of two
  std::vector<Row> rows_;
  std::uint32_t turn_ = 0, turns_ = kTurns;
  bool all_ = true;
};

}  // namespace clamor
