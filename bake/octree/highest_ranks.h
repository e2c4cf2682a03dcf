// highest_ranks.h: selects the kNodeSources highest ranks of a stream.
//
// Sources are ordered by descending key, equal keys by their position in the list. A rank packs
// both into one integer: the bits of the key above, the complement of the position below.
//
// Memory: 2 kNodeSources ranks, inside the object. Cost: almost always one comparison per offer.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "formats/bake_file/source_octree.h"

namespace clamor {

// Maps a key to an integer of the same order; 0 and -0 compare equal, as floats do.
inline std::uint32_t key_bits(float key) {
  const auto bits = std::bit_cast<std::uint32_t>(key + 0.0f);
  return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}

// Higher ranks come first in the octree.
inline std::uint64_t octree_rank(std::uint32_t bits_of_key, std::uint32_t place) {
  return (std::uint64_t{bits_of_key} << 32) | (0xffffffffu - place);
}
inline std::uint32_t place_of_rank(std::uint64_t rank) {
  return 0xffffffffu - static_cast<std::uint32_t>(rank);
}

class HighestRanks {
 public:
  // Each rank may be offered once.
  void offer(std::uint64_t rank) {
    if (rank < lowest_) return;
    ranks_[count_++] = rank;
    if (count_ == ranks_.size()) trim();
  }

  // The highest ranks so far, in descending order. The span is valid until the next offer().
  std::span<const std::uint64_t> descending() {
    if (count_ > kNodeSources) trim();
    std::sort(ranks_.begin(), ranks_.begin() + static_cast<std::ptrdiff_t>(count_),
              std::greater<>());
    return {ranks_.data(), count_};
  }

 private:
  void trim() {
    const auto last = ranks_.begin() + kNodeSources - 1;
    std::nth_element(ranks_.begin(), last, ranks_.begin() + static_cast<std::ptrdiff_t>(count_),
                     std::greater<>());
    lowest_ = *last;
    count_ = kNodeSources;
  }

  std::array<std::uint64_t, std::size_t{2} * kNodeSources> ranks_;
  std::size_t count_ = 0;
  std::uint64_t lowest_ = 0;  // lower ranks cannot be among the highest
};

}  // namespace clamor
