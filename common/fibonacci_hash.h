// fibonacci_hash.h: hash of integers for tables whose size is a power of two.
#pragma once

#include <cstddef>
#include <cstdint>

namespace clamor {

// Multiplies by 2^64 / golden ratio (D. E. Knuth. The Art of Computer Programming, vol. 3, 6.4).
// Use the low bits.
constexpr std::size_t fibonacci_hash(std::uint64_t number) {
  number *= 0x9e3779b97f4a7c15u;
  return static_cast<std::size_t>(number ^ (number >> 32));
}

}  // namespace clamor
