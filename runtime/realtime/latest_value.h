// latest_value.h: hands the newest value from one thread to another; neither ever waits.
//
// Carries the listener's pose to the sampler. Only the newest value counts: one that is overtaken
// before it is read is never seen, by design. There are three slots. The writer owns one, the
// reader owns one, the third lies between them, and a side is done with its slot when it trades it
// for the middle one in a single atomic exchange.
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

  // The newest value, or the same one as last time if nothing came (at first, a T{}).
  // The reference holds until the next call.
  const T& latest() noexcept REALTIME {
    if (middle_.load(std::memory_order_relaxed) & kFresh)
      reading_ = middle_.exchange(reading_, std::memory_order_acq_rel) & kSlot;
    return slots_[reading_];
  }

 private:
  static constexpr unsigned kSlot = 3, kFresh = 4;

  std::array<T, 3> slots_{};
  unsigned writing_ = 0;                         // the publishing thread's alone
  alignas(64) std::atomic<unsigned> middle_{1};  // slot number, | kFresh until read
  alignas(64) unsigned reading_ = 2;             // the reading thread's alone
};

}  // namespace clamor
