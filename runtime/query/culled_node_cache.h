// culled_node_cache.h: of which nodes of the octree nothing is heard for a while, with all that is
// below.
//
// Bounds of a node hold for the sharpest lobe of any material and for the loudest that any signal
// soon is; so most nodes that they cannot leave out have nothing to be found. That is known once
// one has looked: where the shortlist of a node is empty (page_shortlists.h), and each child is
// quiet itself or left out by its bound, for all places in a ball, any higher threshold, until some
// time, then so is the node. A keyframe later it is passed over, and all below it.
//
// Threads: the sampler's alone.   Memory: 80 to 160 bytes per quiet node.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/vec.h"

namespace clamor {

// Where, when and above which threshold nothing is found. In the space of a copied tree.
struct ValidityRegion {
  Vec3 place{};
  double give_m = std::numeric_limits<double>::infinity();  // how far from there; below 0: never
  double threshold = 0;
  double until_s = std::numeric_limits<double>::infinity();

  // What is left of it at another place.
  ValidityRegion seen_from(const Vec3& other) const {
    ValidityRegion seen = *this;
    if (give_m < std::numeric_limits<double>::infinity()) seen.give_m -= length(other - place);
    seen.place = other;
    return seen;
  }
  // Where both are; of one place.
  void narrow(const ValidityRegion& other) {
    give_m = std::min(give_m, other.give_m);
    threshold = std::max(threshold, other.threshold);
    until_s = std::min(until_s, other.until_s);
  }
  bool holds(double at_threshold, double at_s) const {
    return give_m >= 0 && at_threshold >= threshold && at_s <= until_s;
  }
};

class CulledNodeCache {
 public:
  CulledNodeCache() : slots_(1 << 10) {}

  // Of the node whose page is there in the file, and whose first source has that number.
  static std::uint64_t key_of(std::uint64_t page_offset, std::uint64_t first) {
    const std::uint64_t key = page_offset * 0x9e3779b97f4a7c15u + first * 0xd6e8feb86659fd93u;
    return key == 0 ? 1 : key;
  }

  // Null if nothing is known. Valid until the next set().
  const ValidityRegion* find(std::uint64_t key) const {
    const Slot& slot = slots_[place_of(key)];
    return slot.key == key ? &slot.quiet : nullptr;
  }
  void set(std::uint64_t key, const ValidityRegion& quiet);
  void clear();

 private:
  struct Slot {
    std::uint64_t key = 0;  // 0: free
    ValidityRegion quiet;
  };
  std::size_t place_of(std::uint64_t key) const {
    for (std::size_t at = key ^ (key >> 29);; ++at) {
      const std::uint64_t here = slots_[at & (slots_.size() - 1)].key;
      if (here == key || here == 0) return at & (slots_.size() - 1);
    }
  }

  std::vector<Slot> slots_;  // open addressing, a power of two
  std::size_t count_ = 0;
};

}  // namespace clamor
