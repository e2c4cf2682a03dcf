// bit_reader.h: unpacks what bit_columns.h packed.
//
// All of it is inlined, so that it is compiled for the instruction set of whoever calls it.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "common/maths.h"
#include "formats/bit_columns.h"

namespace clamor {

// Of bytes that BitWriter did not write it reads at least nothing beyond their end: then it says so
// once and for all in ok(), and whatever is read has no meaning.
class BitReader {
 public:
  static constexpr std::size_t kSlackBytes = 24;
  static constexpr std::size_t kMostNumbers = 1000;  // of a column

  // kSlackBytes more than these must be readable.
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

  // unpack_even(bytes, bit, k, base, values, count) is to set each value to base + the next k bits.
  template <class UnpackEven>
  CLAMOR_INLINE void get_column(std::int32_t* values, std::size_t count,
                                const UnpackEven& unpack_even) {
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
    add_unary(values, count, k);
    if (kind == kSigned)
      for (std::size_t i = 0; i < count; ++i)
        values[i] = as_number(base + from_zigzag(as_bits(values[i])));
  }

  CLAMOR_INLINE void get_column(std::int32_t* values, std::size_t count) {
    get_column(values, count, unpack_one_by_one);
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

  CLAMOR_INLINE bool ok() const { return ok_; }

  // That all was read, and what fills up the last byte is zero.
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
  CLAMOR_INLINE std::uint64_t word_at(std::size_t bit) const {  // 57 bits at least
    std::uint64_t word = 0;
    std::memcpy(&word, bytes_ + bit / 8, sizeof word);
    return word >> bit % 8;
  }
  CLAMOR_INLINE void fail() {
    ok_ = false;
    at_ = end_;
  }

  // Adds q << k to each. The ones are found without asking after each whether it was the word's
  // last: eight at a time, and those that were not there are written over by the next word's.
  CLAMOR_INLINE void add_unary(std::int32_t* values, std::size_t count, int k) {
    constexpr std::size_t kWordBits = 56, kAtOnce = 8;
    constexpr std::uint64_t kWord = (std::uint64_t{1} << kWordBits) - 1;
    std::array<std::uint32_t, 1 + kMostNumbers + kWordBits + kAtOnce> ones;  // from at_
    ones[0] = ~0u;
    std::size_t from = 0;
    for (std::size_t found = 0; found < count; from += kWordBits) {
      if (at_ + from >= end_) return fail();
      std::uint64_t word = word_at(at_ + from) & kWord;
      if (end_ - at_ - from < kWordBits) word &= (std::uint64_t{1} << (end_ - at_ - from)) - 1;
      const auto more = static_cast<std::size_t>(std::popcount(word));
      std::uint32_t* one = ones.data() + 1 + found;
      for (std::size_t i = 0; i < more; i += kAtOnce)
        for (std::size_t j = 0; j < kAtOnce; ++j, word &= word - 1)
          *one++ =
              static_cast<std::uint32_t>(from) + static_cast<std::uint32_t>(std::countr_zero(word));
      found += more;
    }
    for (std::size_t i = 0; i < count; ++i)
      values[i] = as_number(as_bits(values[i]) + ((ones[i + 1] - ones[i] - 1) << k));
    at_ += ones[count] + 1;
  }

  const std::byte* bytes_;
  std::size_t at_ = 0, end_;
  bool ok_ = true;
};

}  // namespace clamor
