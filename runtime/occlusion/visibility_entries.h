// visibility_entries.h: the sources that a VisibilityCache knows, found by source number.
//
// Threads: the sampler's alone.   Memory: 200 to 280 bytes per source.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/bands.h"
#include "common/fibonacci_hash.h"
#include "common/vec.h"
#include "runtime/occlusion/occlusion_upper_bounds.h"

namespace clamor {

// Precision of a visibility, by rising cost (visibility_cache.h).
enum class VisibilityPrecision : std::uint8_t { kLineTest, kCoarse, kMedium, kFine };

// A source's visibility and when and how it was found. Retesting reads one cache line per source.
struct alignas(64) VisibilityEntry {
  std::uint64_t number = 0;
  Vec3f listener_m{};  // at the last test or estimate
  float validity_radius_m = 0;
  Vec3f origin_m{};          // of the source's rays
  float priority_at_1m = 0;  // without occlusion
  float change_clock = 0;    // of the grid, at the last test or estimate
  // Keyframes of the last test or estimate, of the last estimate, and of the last use.
  std::uint32_t updated = 0, estimated = 0, used = 0;
  VisibilityPrecision precision = VisibilityPrecision::kLineTest;
  bool has_origin = false, line_is_free = false, occluded = false;
  std::uint8_t step = OcclusionUpperBounds::kUnoccluded;
  Bands diffracted{};  // share of the power that passes beside the surfaces
  Bands visibility{};  // and what is transmitted through them, too
};

// A flat hash map from source numbers to entries. An index stays valid until remove_unused(), and
// carries the flag kOccluded where nothing of the source is audible.
class VisibilityEntries {
 public:
  using Index = std::uint32_t;
  static constexpr Index kUnknown = 0xffffffff, kOccluded = 0x80000000;

  VisibilityEntries() : slots_(kMinSlots) {}

  VisibilityEntry& operator[](Index index) { return entries_[index & ~kOccluded]; }
  const VisibilityEntry& operator[](Index index) const { return entries_[index & ~kOccluded]; }

  // Prefetches what find() reads.
  void prefetch(std::uint64_t number) const {
    __builtin_prefetch(&slots_[fibonacci_hash(number) & (slots_.size() - 1)]);
  }

  Index find(std::uint64_t number) const {
    return const_cast<VisibilityEntries*>(this)->slot_of(number).index;
  }

  // Adds a number that is not known yet.
  Index add(std::uint64_t number) {
    const auto index = static_cast<Index>(entries_.size());
    entries_.emplace_back().number = number;
    if (2 * entries_.size() > slots_.size()) {
      std::vector<Slot> old(2 * slots_.size());
      slots_.swap(old);
      for (const Slot& slot : old)
        if (slot.index != kUnknown) slot_of(slot.number) = slot;
    }
    slot_of(number) = {number, index};
    return index;
  }

  void set_occluded(VisibilityEntry& entry, bool occluded) {
    if (occluded == entry.occluded) return;
    entry.occluded = occluded;
    slot_of(entry.number).index ^= kOccluded;
  }

  // Whether so many numbers are known that unused ones should be removed.
  bool is_crowded() const { return 4 * entries_.size() > slots_.size(); }

  // Removes the entries that `is_unused`; all indices change. Returns the entries that stay.
  template <class Predicate>
  const std::vector<VisibilityEntry>& remove_unused(const Predicate& is_unused) {
    std::erase_if(entries_, is_unused);
    std::size_t size = kMinSlots;
    while (size < 4 * entries_.size() + 4) size *= 2;
    slots_.assign(size, Slot{});
    for (Index i = 0; i < entries_.size(); ++i)
      slot_of(entries_[i].number) = {entries_[i].number,
                                     i | (entries_[i].occluded ? kOccluded : 0)};
    return entries_;
  }

 private:
  static constexpr std::size_t kMinSlots = 1 << 12;

  struct Slot {
    std::uint64_t number = 0;
    Index index = kUnknown;  // of the entry, with its flag; kUnknown: the slot is free
  };

  // The number's slot, or the free one that it would take.
  Slot& slot_of(std::uint64_t number) {
    for (std::size_t at = fibonacci_hash(number);; ++at) {
      Slot& slot = slots_[at & (slots_.size() - 1)];
      if (slot.index == kUnknown || slot.number == number) return slot;
    }
  }

  std::vector<Slot> slots_;  // open addressing, a power of two
  std::vector<VisibilityEntry> entries_;
};

}  // namespace clamor
