// memory_size.h: sizes that a file claims, as sizes of memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>

namespace clamor {

// A number of bytes or elements to hold in memory. Where size_t has 32 bits, more than these can
// count is more than there is: std::bad_alloc, as from an allocation of that size.
constexpr std::size_t memory_size(std::uint64_t count) {
  if (count > std::numeric_limits<std::size_t>::max()) throw std::bad_alloc();
  return static_cast<std::size_t>(count);
}

}  // namespace clamor
