// handle_table.h: objects that an application knows by number.
//
// A handle names a slot of the table, the slot's generation and the table itself, so that a handle
// that is stale, invented or from another table finds nothing. The audio thread enters an object
// without a lock; removing one waits until the audio thread has left it.
//
// Threads: insert(), find(), remove() and for_each() on one at a time; enter() and leave() on any
// thread, which find an object busy that another one has entered.   Memory: all slots at
// construction.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/realtime/realtime.h"

namespace clamor {

template <class T>
class HandleTable {
 public:
  // `tag` distinguishes tables; 15 bits of it count.
  HandleTable(std::size_t capacity, std::uint64_t tag)
      : slots_(capacity), tag_((tag & kTags) << 48) {}

  // Returns the new object's handle, which is not 0; or 0 if the table is full. Slots are taken in
  // turn, so that one that became free is not taken again at once.
  std::uint64_t insert(std::shared_ptr<T> object) {
    for (std::size_t tried = 0; tried < slots_.size(); ++tried) {
      const std::size_t i = (next_ + tried) % slots_.size();
      Slot& slot = slots_[i];
      if (slot.object != nullptr) continue;
      next_ = i + 1;
      slot.object = std::move(object);
      slot.generation = (slot.generation + 1) & kGenerations;
      if (slot.generation == 0) slot.generation = 1;  // so that no handle is 0
      const std::uint64_t handle = tag_ | slot.generation << 16 | i;
      slot.state.store(handle << 1, std::memory_order_release);
      return handle;
    }
    return 0;
  }

  std::shared_ptr<T> find(std::uint64_t handle) const {
    const Slot* const slot = slot_of(handle);
    return slot == nullptr ? nullptr : slot->object;
  }

  // Returns the object, which no thread has entered any more, or null.
  std::shared_ptr<T> remove(std::uint64_t handle) {
    Slot* const slot = const_cast<Slot*>(slot_of(handle));
    if (slot == nullptr) return nullptr;
    std::uint64_t free = state_of(handle);
    while (!slot->state.compare_exchange_weak(free, 0, std::memory_order_acq_rel)) {
      free = state_of(handle);
      std::this_thread::yield();
    }
    return std::exchange(slot->object, nullptr);
  }

  template <class Act>
  void for_each(const Act& act) const {
    for (const Slot& slot : slots_)
      if (slot.object != nullptr) act(slot.object);
  }

  template <class Act>
  void for_each_handle(const Act& act) const {
    for (std::size_t i = 0; i < slots_.size(); ++i)
      if (slots_[i].object != nullptr) act(tag_ | slots_[i].generation << 16 | i);
  }

  std::size_t capacity() const { return slots_.size(); }
  // The slot that a handle names, below the capacity.
  static std::size_t slot_number(std::uint64_t handle) { return handle & kSlots; }

  enum class Entry : std::uint8_t { kEntered, kBusy, kUnknown };
  // If the object is entered, leave() must follow.
  Entry enter(std::uint64_t handle, T*& object) noexcept REALTIME {
    const std::size_t index = handle & kSlots;
    if (handle == 0 || handle > kMaxHandle || index >= slots_.size()) return Entry::kUnknown;
    Slot& slot = slots_[index];
    std::uint64_t state = state_of(handle);
    if (slot.state.compare_exchange_strong(state, state | kBusy, std::memory_order_acq_rel)) {
      object = slot.object.get();
      return Entry::kEntered;
    }
    return state == (state_of(handle) | kBusy) ? Entry::kBusy : Entry::kUnknown;
  }
  void leave(std::uint64_t handle) noexcept REALTIME {
    slots_[handle & kSlots].state.store(state_of(handle), std::memory_order_release);
  }

 private:
  static constexpr std::uint64_t kSlots = 0xffff, kGenerations = 0x7fffffff, kTags = 0x7fff;
  static constexpr std::uint64_t kMaxHandle = ~std::uint64_t{0} >> 1;  // a state has a bit more
  static constexpr std::uint64_t kBusy = 1;

  struct Slot {
    std::shared_ptr<T> object;
    std::uint64_t generation = 0;
    std::atomic<std::uint64_t> state{
        0};  // the handle, shifted, and kBusy while it is entered; or 0
  };

  static std::uint64_t state_of(std::uint64_t handle) noexcept { return handle << 1; }

  const Slot* slot_of(std::uint64_t handle) const {
    const std::size_t index = handle & kSlots;
    if (handle == 0 || index >= slots_.size()) return nullptr;
    const Slot& slot = slots_[index];
    const bool is_named =
        slot.object != nullptr && (tag_ | slot.generation << 16 | index) == handle;
    return is_named ? &slot : nullptr;
  }

  std::vector<Slot> slots_;
  std::size_t next_ = 0;
  const std::uint64_t tag_;
};

}  // namespace clamor
