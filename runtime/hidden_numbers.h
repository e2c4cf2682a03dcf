// hidden_numbers.h: which sources nothing is heard of, as bits beside their numbers.
//
// Behind a wall there may be twice as many sources that would matter as before it. A pool asks this
// before it looks at one any closer, so that those cost a bit each and no more. That something is
// hidden must be asked again as the listener walks: numbers take turns, every fourth at a time, and
// those whose turn it is are not left out.
//
// Threads: the sampler's alone.   Memory: 32 to 64 bytes per 64 numbers any of which was hidden.
#pragma once

#include <cstdint>
#include <vector>

namespace clamor {

class HiddenNumbers {
 public:
  static constexpr std::uint32_t kTurns = 4;

  HiddenNumbers();

  void set(std::uint64_t number, bool hidden);
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

  // The bits of the numbers from 64 `word`: those that may be left out.
  std::uint64_t left_out(std::uint64_t word) const {
    static_assert(kTurns == 4);
    constexpr std::uint64_t kEveryFourth = 0x1111'1111'1111'1111;
    return all_ ? 0 : find(word).bits & ~(kEveryFourth << turn_);
  }

 private:
  struct Word {
    std::uint64_t key = 0;  // 1 + word; 0: free
    std::uint64_t bits = 0;
  };
  static std::uint64_t hash_of(std::uint64_t word) {
    word *= 0x9e3779b97f4a7c15u;
    return word ^ (word >> 29);
  }
  const Word& find(std::uint64_t word) const {
    for (std::uint64_t at = hash_of(word) >> 20;; ++at) {
      const Word& here = words_[at & (words_.size() - 1)];
      if (here.key == word + 1 || here.key == 0) return here;
    }
  }

  std::vector<Word> words_;  // open addressing, a power of two
  std::size_t count_ = 0;
  std::uint32_t turn_ = 0;
  bool all_ = false;
};

}  // namespace clamor
