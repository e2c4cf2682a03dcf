// prefetch.h: fetching what is written next, ahead of time.
#pragma once

#include <cstddef>

#include "runtime/realtime/realtime.h"

namespace clamor {

// All cache lines of so many bytes.
inline void prefetch_to_write(const void* first, std::size_t bytes) noexcept REALTIME {
  constexpr std::size_t kLine = 64;
  for (std::size_t at = 0; at < bytes; at += kLine)
    __builtin_prefetch(static_cast<const char*>(first) + at, 1);
}

}  // namespace clamor
