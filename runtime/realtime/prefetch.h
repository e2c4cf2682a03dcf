// prefetch.h: cache prefetches of whole objects.
#pragma once

#include <cstddef>

#include "runtime/realtime/realtime.h"

namespace clamor {

inline constexpr std::size_t kCacheLine = 64;  // bytes

// Prefetches every cache line of `bytes` bytes.
inline void prefetch_to_read(const void* first, std::size_t bytes) noexcept REALTIME {
  for (std::size_t at = 0; at < bytes; at += kCacheLine)
    __builtin_prefetch(static_cast<const char*>(first) + at);
}
inline void prefetch_to_write(const void* first, std::size_t bytes) noexcept REALTIME {
  for (std::size_t at = 0; at < bytes; at += kCacheLine)
    __builtin_prefetch(static_cast<const char*>(first) + at, 1);
}

}  // namespace clamor
