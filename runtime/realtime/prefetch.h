// prefetch.h: fetching what is read or written next, ahead of time.
#pragma once

#include <cstddef>

#include "runtime/realtime/realtime.h"

namespace clamor {

inline constexpr std::size_t kCacheLine = 64;  // bytes

// All cache lines of so many bytes.
inline void prefetch_to_read(const void* first, std::size_t bytes) noexcept REALTIME {
  for (std::size_t at = 0; at < bytes; at += kCacheLine)
    __builtin_prefetch(static_cast<const char*>(first) + at);
}
inline void prefetch_to_write(const void* first, std::size_t bytes) noexcept REALTIME {
  for (std::size_t at = 0; at < bytes; at += kCacheLine)
    __builtin_prefetch(static_cast<const char*>(first) + at, 1);
}

}  // namespace clamor
