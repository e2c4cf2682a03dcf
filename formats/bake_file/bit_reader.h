// bit_reader.h: unpacks the columns of bit_writer.h.
//
// Everything is inlined, so that it is compiled for the instruction set of the caller.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "common/maths.h"
#include "formats/bake_file/bit_writer.h"

namespace clamor {

// Never reads beyond the end of invalid data: ok() is false from then on, and values are
// meaningless.
class BitReader {
 public:
  static constexpr std::size_t kSlackBytes = 24;
  static constexpr std::size_t kMaxColumnValues = 1000;  // per column

  // kSlackBytes beyond `bytes` must be readable.
  explicit BitReader(std::span<const std::byte> bytes)
      : bytes_(bytes.data()), end_(8 * bytes.size()) {}

  CLAMOR_INLINE std::uint32_t get(int bits) {
    if (static_cast<std::size_t>(bits) > end_ - at_) {
      fail();
      return 0;
    }
    const std::uint64_t word = word_at(at_);
    at_ += static_cast<std::size_t>(bits);
    return static_cast<std::uint32_t>(word & ((std::uint64_t{1} << bits) - 1));
  }

  CLAMOR_INLINE std::int32_t get_signed(int bits) {
    return static_cast<std::int32_t>(get(bits) << (32 - bits)) >> (32 - bits);
  }

  // Bit positions of the ones of a column, relative to the byte in which its unary parts begin.
  // Element 0 is the position before the first. There is room for a word of excess ones.
  using Ones = std::array<std::uint16_t, 1 + kMaxColumnValues + 64 + 8>;

  // unpack_even(bytes, bit, k, base, values, count) must set each value to base + the next k bits.
  // find_ones(word, from, ones) must write the positions of the set bits of a word, plus `from`,
  // and may write seven elements more.
  template <class UnpackEven, class FindOnes>
  CLAMOR_INLINE void get_column(std::int32_t* values, std::size_t count,
                                const UnpackEven& unpack_even, const FindOnes& find_ones) {
    if (count == 0) return;
    const std::uint32_t kind = get(2);
    const int k = bits_of(get(5));
    const std::uint32_t base = from_zigzag(get(bits_of(get(5))));
    const std::size_t bits = count * static_cast<std::size_t>(k);
    if (kind > kSigned || (kind != kEven && k > 30) || !ok_ || bits > end_ - at_) {
      std::fill_n(values, count, 0);
      return fail();
    }
    const std::uint32_t first = kind == kSigned ? 0 : base;
    if (k == 0)
      std::fill_n(values, count, as_number(first));
    else
      unpack_even(bytes_, at_, k, first, values, count);
    at_ += bits;
    if (kind == kEven) return;
    Ones ones;
    if (!read_ones(ones, count, find_ones)) {
      add_unary_one_by_one(values, count, k);
      if (kind != kSigned) return;
      for (std::size_t i = 0; i < count; ++i)
        values[i] = as_number(base + from_zigzag(as_bits(values[i])));
      return;
    }
    const auto number = [&](std::size_t i) {
      const auto zeros = static_cast<std::uint16_t>(ones[i + 1] - ones[i] - 1);
      return as_bits(values[i]) + (std::uint32_t{zeros} << k);
    };
    if (kind == kSmall)
      for (std::size_t i = 0; i < count; ++i) values[i] = as_number(number(i));
    else
      for (std::size_t i = 0; i < count; ++i) values[i] = as_number(base + from_zigzag(number(i)));
  }

  CLAMOR_INLINE void get_column(std::int32_t* values, std::size_t count) {
    get_column(values, count, unpack_one_by_one, find_ones_one_by_one);
  }

  CLAMOR_INLINE static void unpack_one_by_one(const std::byte* bytes, std::size_t bit, int k,
                                              std::uint32_t base, std::int32_t* values,
                                              std::size_t count) {
    const std::uint64_t mask = (std::uint64_t{1} << k) - 1;
    for (std::size_t i = 0; i < count; ++i, bit += static_cast<std::size_t>(k)) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes + bit / 8, sizeof word);
      values[i] = as_number(base + static_cast<std::uint32_t>(word >> bit % 8 & mask));
    }
  }

  CLAMOR_INLINE static void find_ones_one_by_one(std::uint64_t word, std::uint32_t from,
                                                 std::uint16_t* ones) {
    for (; word != 0; word &= word - 1)
      *ones++ =
          static_cast<std::uint16_t>(from + static_cast<std::uint32_t>(std::countr_zero(word)));
  }

  CLAMOR_INLINE bool ok() const { return ok_; }

  // Returns whether all bits were read and the padding of the last byte is zero.
  CLAMOR_INLINE bool at_end() {
    return ok_ && end_ - at_ < 8 && get(static_cast<int>(end_ - at_)) == 0;
  }

 private:
  CLAMOR_INLINE static std::uint32_t as_bits(std::int32_t value) {
    return static_cast<std::uint32_t>(value);
  }
  CLAMOR_INLINE static std::int32_t as_number(std::uint32_t bits) {
    return static_cast<std::int32_t>(bits);
  }
  CLAMOR_INLINE static std::uint32_t from_zigzag(std::uint32_t code) {
    return code >> 1 ^ (0u - (code & 1));
  }
  CLAMOR_INLINE static int bits_of(std::uint32_t field) {
    return field == 31 ? 32 : static_cast<int>(field);
  }
  CLAMOR_INLINE std::uint64_t word_at(std::size_t bit) const {  // at least 57 valid bits
    std::uint64_t word = 0;
    std::memcpy(&word, bytes_ + bit / 8, sizeof word);
    return word >> bit % 8;
  }
  CLAMOR_INLINE void fail() {
    ok_ = false;
    at_ = end_;
  }

  // Reads the unary parts of a column if they end within the next 65 000 bits; otherwise reads
  // nothing.
  template <class FindOnes>
  CLAMOR_INLINE bool read_ones(Ones& ones, std::size_t count, const FindOnes& find_ones) {
    constexpr std::size_t kFarthest = 65'000;
    const std::size_t first_byte = at_ / 8;
    std::uint64_t word = 0;
    std::memcpy(&word, bytes_ + first_byte, sizeof word);
    word &= ~std::uint64_t{0} << at_ % 8;
    ones[0] = static_cast<std::uint16_t>(at_ % 8 - 1);
    std::size_t from = 0;
    for (std::size_t found = 0;;) {
      find_ones(word, static_cast<std::uint32_t>(from), ones.data() + 1 + found);
      found += static_cast<std::size_t>(std::popcount(word));
      if (found >= count) break;
      from += 64;
      if (from > kFarthest || 8 * first_byte + from >= end_) return false;
      std::memcpy(&word, bytes_ + first_byte + from / 8, sizeof word);
    }
    const std::size_t after = 8 * first_byte + ones[count] + 1;
    if (after > end_) return false;
    at_ = after;
    return true;
  }

  // Adds q << k to every value.
  CLAMOR_INLINE void add_unary_one_by_one(std::int32_t* values, std::size_t count, int k) {
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t zeros = 0;
      for (;; zeros += 56, at_ += 56) {
        if (at_ >= end_) return fail();
        const std::uint64_t word = word_at(at_);
        const auto more =
            static_cast<std::uint32_t>(std::countr_zero(word | std::uint64_t{1} << 56));
        if (more == 56) continue;
        zeros += more;
        at_ += more + 1;
        break;
      }
      if (at_ > end_) return fail();
      values[i] = as_number(as_bits(values[i]) + (zeros << k));
    }
  }

  const std::byte* bytes_;
  std::size_t at_ = 0, end_;
  bool ok_ = true;
};

}  // namespace clamor
