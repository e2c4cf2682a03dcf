// flat_hash_map.h: a map from integers to small values in one array, for lookups in inner loops.
//
// Open addressing with linear probing and Fibonacci hashing, at most half full. A lookup of a
// present or absent key usually reads one cache line. Successive keys share some, since they are
// often looked up one after the other. Keys are never erased one by one: owners
// rebuild the map from what they keep. The order of iteration is unspecified, so nothing may
// depend on it.
//
// Threads: const functions may be called concurrently.   Memory: 2 to 4 slots per key.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/fibonacci_hash.h"

namespace clamor {

template <class Value>
class FlatHashMap {
 public:
  // `min_slots` is a power of two.
  explicit FlatHashMap(std::size_t min_slots = 16) : min_slots_(min_slots), slots_(min_slots) {
    assert((min_slots & (min_slots - 1)) == 0 && min_slots >= 2);
  }

  std::size_t size() const { return size_; }
  std::size_t slot_count() const { return slots_.size(); }
  bool is_full() const {
    return 2 * (size_ + 1) > slots_.size();
  }  // the next insertion may grow it

  // The value of a key, or null. Valid until the next insertion.
  const Value* find(std::uint64_t key) const {
    const Slot& slot = slots_[place_of(key)];
    return slot.is_used ? &slot.value : nullptr;
  }
  Value* find(std::uint64_t key) { return const_cast<Value*>(std::as_const(*this).find(key)); }

  // The value of a key, inserted with its default if absent. Valid until the next insertion.
  Value& operator[](std::uint64_t key) {
    std::size_t place = place_of(key);
    if (!slots_[place].is_used) {
      if (is_full()) {
        rehash(2 * slots_.size());
        place = place_of(key);
      }
      slots_[place].key = key;
      slots_[place].is_used = true;
      ++size_;
    }
    return slots_[place].value;
  }

  // Brings the slot of a key into the cache.
  void prefetch(std::uint64_t key) const {
    __builtin_prefetch(&slots_[first_place_of(key) & (slots_.size() - 1)]);
  }

  // Removes all keys and makes room for `count`.
  void clear(std::size_t count = 0) {
    std::size_t slots = min_slots_;
    while (slots < 4 * count) slots *= 2;
    slots_.assign(slots, Slot{});
    size_ = 0;
  }

  // Removes the keys for which condemned(key, value) holds.
  template <class Condemned>
  void erase_if(const Condemned& condemned) {
    std::vector<Slot> old = std::move(slots_);
    std::erase_if(
        old, [&](const Slot& slot) { return !slot.is_used || condemned(slot.key, slot.value); });
    clear(old.size());
    for (Slot& slot : old) slots_[place_of(slot.key)] = std::move(slot);
    size_ = old.size();
  }

 private:
  struct Slot {
    std::uint64_t key = 0;
    Value value{};
    bool is_used = false;
  };

  static constexpr std::uint64_t kNeighbours = 4;

  static std::size_t first_place_of(std::uint64_t key) {
    return fibonacci_hash(key / kNeighbours) * kNeighbours + key % kNeighbours;
  }

  // The slot of the key, or the free one where it would be.
  std::size_t place_of(std::uint64_t key) const {
    for (std::size_t at = first_place_of(key);; ++at) {
      const std::size_t place = at & (slots_.size() - 1);
      if (!slots_[place].is_used || slots_[place].key == key) return place;
    }
  }

  void rehash(std::size_t slots) {
    std::vector<Slot> old(slots);
    slots_.swap(old);
    for (Slot& slot : old)
      if (slot.is_used) slots_[place_of(slot.key)] = std::move(slot);
  }

  std::size_t min_slots_;
  std::vector<Slot> slots_;
  std::size_t size_ = 0;
};

}  // namespace clamor
