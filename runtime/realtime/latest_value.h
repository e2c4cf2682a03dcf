// latest_value.h: a triple buffer that hands the newest value from one thread to another without
// waiting.
//
// Carries the listener to the sampler, for example. A value that is overtaken before it is read is
// never seen, by design. The writer owns one slot, the reader owns one, and the third lies between
// them. Each side trades its slot for the middle one in a single atomic exchange.
//
// Threads: publish() on one thread, latest() on one other.   Memory: three T, inside the object.
#pragma once

#include <array>
#include <atomic>
#include <type_traits>

#include "runtime/realtime/realtime.h"

namespace clamor {

template <class T>
class LatestValue {
  static_assert(std::is_trivially_copyable_v<T>, "copying must not allocate");

 public:
  // Makes `value` the newest. Never fails and never waits for the reader.
  void publish(const T& value) noexcept REALTIME {
    slots_[writing_] = value;
    writing_ = middle_.exchange(writing_ | kFresh, std::memory_order_acq_rel) & kSlot;
  }

  // The newest value, the same as last time if none was published, or at first a T{}. The reference
  // is valid until the next call.
  const T& latest() noexcept REALTIME {
    if (middle_.load(std::memory_order_relaxed) & kFresh)
      reading_ = middle_.exchange(reading_, std::memory_order_acq_rel) & kSlot;
    return slots_[reading_];
  }

 private:
  static constexpr unsigned kSlot = 3, kFresh = 4;

  std::array<T, 3> slots_{};
  unsigned writing_ = 0;                         // owned by the publishing thread
  alignas(64) std::atomic<unsigned> middle_{1};  // slot number, | kFresh until read
  alignas(64) unsigned reading_ = 2;             // owned by the reading thread
};

}  // namespace clamor
