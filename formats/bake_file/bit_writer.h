// bit_writer.h: columns of whole numbers, packed to the bit. bit_reader.h unpacks them.
//
// A column of n numbers is stored in whichever of three ways is shortest:
//
//   even     base + k bits
//   small    base + (q << k | k bits)                 q in unary: Robert F. Rice, JPL 79-22, 1979
//   signed   base + zigzag^-1 of (q << k | k bits)    0, -1, 1, -2, 2, ... <- 0, 1, 2, 3, 4, ...
//
// All k bits stand first, then all q (as q zeros and a one): so every number's place among the k
// bits is known, and the ones are found a word at a time. Numbers are 32 bits and wrap.
//
//   2 bits   0 even, 1 small, 2 signed
//   5 bits   k, 31 meaning 32
//   5 bits   L, 31 meaning 32
//   L bits   the base, zigzag
//   n k bits, then for small and signed the unary numbers
//
// Bits are taken from the lowest of a byte up. An empty column is nothing at all.
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

  // The bits so far, the last byte filled up with zeros.
  std::vector<std::byte> take();

 private:
  static std::uint32_t low_bits(int bits) { return bits >= 32 ? ~0u : (1u << bits) - 1; }
  std::vector<std::byte> bytes_;
  std::uint64_t pending_ = 0;
  int pending_bits_ = 0;
};

// Bits that put_column() takes for them.
std::uint64_t column_bits(std::span<const std::int32_t> values);

}  // namespace clamor
