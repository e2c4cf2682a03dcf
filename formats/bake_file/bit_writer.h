// bit_writer.h: packs columns of integers to the bit. bit_reader.h unpacks them.
//
// A column of n numbers is stored in the shortest of three encodings:
//
//   even     base + k bits
//   small    base + (q << k | k bits)                 q in unary: Robert F. Rice, JPL 79-22, 1979
//   signed   base + zigzag^-1 of (q << k | k bits)    0, -1, 1, -2, 2, ... <- 0, 1, 2, 3, 4, ...
//
// The k-bit parts precede all unary parts q (q zeros and a one), so the position of every k-bit
// part is known and the ones can be found a word at a time. Numbers have 32 bits and wrap.
//
//   2 bits   0 even, 1 small, 2 signed
//   5 bits   k, where 31 means 32
//   5 bits   L, where 31 means 32
//   L bits   the base, zigzag encoded
//   n k bits, then for small and signed the unary numbers
//
// Bits are filled from the lowest of a byte. An empty column takes no bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace clamor {

enum ColumnKind : std::uint32_t { kEven, kSmall, kSigned };

class BitWriter {
 public:
  void put(std::uint32_t value, int bits);
  void put_signed(std::int32_t value, int bits) {
    put(static_cast<std::uint32_t>(value) & low_bits(bits), bits);
  }
  void put_column(std::span<const std::int32_t> values);

  // Returns all bits, padded to a byte with zeros.
  std::vector<std::byte> take();

 private:
  static std::uint32_t low_bits(int bits) { return bits >= 32 ? ~0u : (1u << bits) - 1; }
  std::vector<std::byte> bytes_;
  std::uint64_t pending_ = 0;
  int pending_bits_ = 0;
};

// Size of put_column() in bits.
std::uint64_t column_bits(std::span<const std::int32_t> values);

}  // namespace clamor
