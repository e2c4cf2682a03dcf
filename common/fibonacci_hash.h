// fibonacci_hash.h: numbers that lie close together, spread over a table whose size is a power of
// two.
#pragma once

#include <cstddef>
#include <cstdint>

namespace clamor {

// Its low bits say where to look first. Multiplies by 2^64 over the golden ratio (D. E. Knuth. The
// Art of Computer Programming, vol. 3, 6.4).
constexpr std::size_t fibonacci_hash(std::uint64_t number) {
  number *= 0x9e3779b97f4a7c15u;
  return static_cast<std::size_t>(number ^ (number >> 32));
}

}  // namespace clamor
