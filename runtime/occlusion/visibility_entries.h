// visibility_entries.h: the sources that a VisibilityCache knows, found by source number.
//
// Threads: the sampler's alone.   Memory: 140 to 220 bytes per source.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/bands.h"
#include "common/flat_hash_map.h"
#include "common/vec.h"
#include "runtime/occlusion/occlusion_upper_bounds.h"

namespace clamor {

// Precision of a visibility, by rising cost (visibility_cache.h).
enum class VisibilityPrecision : std::uint8_t { kLineTest, kMedium, kFine };

// A source's visibility and when and how it was found. Retesting reads one cache line per source,
// and the visibility is in the other one.
struct alignas(64) VisibilityEntry {
  std::uint64_t number = 0;
  Vec3f listener_m{};  // at the last test or estimate
  float validity_radius_m = 0;
  Vec3f origin_m{};          // of the source's rays
  float priority_at_1m = 0;  // without occlusion
  float change_clock = 0;    // of the grid, at the last test or estimate
  float share = 1;           // of the sum of all sources, without occlusion
  // Keyframes of the last test or estimate, of the last estimate, and of the last use.
  std::uint32_t updated = 0, estimated = 0, used = 0;
  VisibilityPrecision precision = VisibilityPrecision::kLineTest;
  std::uint8_t step = OcclusionUpperBounds::kUnoccluded;
  bool has_origin : 1 = false, line_is_free : 1 = false, occluded : 1 = false;
  // The visibility and the last estimate are stale once a movable part has crossed the path. A line
  // test renews the visibility alone.
  bool is_stale : 1 = false, estimate_is_stale : 1 = false;
  bool is_direct : 1 = false;      // an emitter or a moving source
  bool is_image : 1 = false;       // of one (image_path.h)
  bool is_over_edges : 1 = false;  // a direct sound that the last estimate heard over edges
  bool is_shared : 1 = false;      // has the mean estimate of its neighbours
  Bands diffracted{};              // share of the power that passes beside the surfaces
  Bands visibility{};              // and what is transmitted through them, too
};
static_assert(sizeof(VisibilityEntry) == 128);

// A flat hash map from source numbers to entries. An index stays valid until remove_unused(), and
// carries the flag kOccluded where nothing of the source is audible.
class VisibilityEntries {
 public:
  using Index = std::uint32_t;
  static constexpr Index kUnknown = 0xffffffff, kOccluded = 0x80000000;

  VisibilityEntry& operator[](Index index) { return entries_[index & ~kOccluded]; }
  const VisibilityEntry& operator[](Index index) const { return entries_[index & ~kOccluded]; }

  // Prefetches what find() reads.
  void prefetch(std::uint64_t number) const { indices_.prefetch(number); }

  Index find(std::uint64_t number) const {
    const Index* index = indices_.find(number);
    return index != nullptr ? *index : kUnknown;
  }

  // Adds a number that is not known yet.
  Index add(std::uint64_t number) {
    const auto index = static_cast<Index>(entries_.size());
    entries_.emplace_back().number = number;
    return indices_[number] = index;
  }

  void set_occluded(VisibilityEntry& entry, bool occluded) {
    if (occluded == entry.occluded) return;
    entry.occluded = occluded;
    *indices_.find(entry.number) ^= kOccluded;
  }

  template <class Act>
  void for_each(const Act& act) {
    for (VisibilityEntry& entry : entries_) act(entry);
  }

  // Returns whether so many numbers are known that unused ones should be removed.
  bool is_crowded() const { return 4 * entries_.size() > indices_.slot_count(); }

  // Removes the entries that `is_unused`; all indices change. Returns the entries that stay.
  template <class Predicate>
  const std::vector<VisibilityEntry>& remove_unused(const Predicate& is_unused) {
    std::erase_if(entries_, is_unused);
    indices_.clear(entries_.size() + 1);
    for (Index i = 0; i < entries_.size(); ++i)
      indices_[entries_[i].number] = i | (entries_[i].occluded ? kOccluded : 0);
    return entries_;
  }

 private:
  static constexpr std::size_t kMinSlots = 1 << 12;

  FlatHashMap<Index> indices_{kMinSlots};  // by source number, with the flag
  std::vector<VisibilityEntry> entries_;
};

}  // namespace clamor
