// prefault_stack.h: has a thread's stack in memory before it is needed.
//
// A stack comes page by page, each by a page fault when it is first used: what mixes voices that
// slide, say, uses more of it than what mixes others, and may do so only after an hour. So an audio
// thread takes those faults at its first callback.
#pragma once

#include <cstddef>

#include "runtime/realtime/realtime.h"

namespace clamor {

inline constexpr std::size_t kTouched_bytes = 64 * 1024;  // kernels use a fifth of it

// The first time that a thread calls it.
[[gnu::noinline]] inline void touch_stack() noexcept REALTIME {
  static thread_local bool touched = false;
  if (touched) return;
  touched = true;
  [[maybe_unused]] volatile char stack[kTouched_bytes];
  for (std::size_t i = 0; i < kTouched_bytes; i += 1024) stack[i] = 0;
}

}  // namespace clamor
