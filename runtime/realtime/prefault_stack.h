// prefault_stack.h: faults a thread's stack in before it is needed.
//
// Each stack page faults at its first use. Some code paths of the mixer use more stack than others
// and may run for the first time after an hour, so the audio thread takes these page faults in its
// first callback.
#pragma once

#include <cstddef>

#include "runtime/realtime/realtime.h"

namespace clamor {

inline constexpr std::size_t kTouched_bytes = 64 * 1024;  // five times what the kernels use

// Does its work at the first call on each thread.
[[gnu::noinline]] inline void prefault_stack() noexcept REALTIME {
  static thread_local bool touched = false;
  if (touched) return;
  touched = true;
  [[maybe_unused]] volatile char stack[kTouched_bytes];
  for (std::size_t i = 0; i < kTouched_bytes; i += 1024) stack[i] = 0;
}

}  // namespace clamor
