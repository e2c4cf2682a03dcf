// page_columns-inl.h: vectorised unpacking of integer columns (bit_reader.h).
// Internal to page_kernel.cpp, which compiles it once per instruction set; hence the unusual
// include guard. Arithmetic wraps.
#if defined(CLAMOR_FORMATS_PAGE_NUMBERS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_FORMATS_PAGE_NUMBERS_INL_H
#undef CLAMOR_FORMATS_PAGE_NUMBERS_INL_H
#else
#define CLAMOR_FORMATS_PAGE_NUMBERS_INL_H
#endif

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <hwy/highway.h>

#include "formats/bake_file/page_workspace.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using namespace page_layout;

using Numbers = PageWorkspace::Numbers;
using Place = PageWorkspace::Place;

HWY_INLINE std::int32_t sum(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b));
}

HWY_INLINE std::int32_t difference(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b));
}

// Returns whether the first n numbers are in [min, max].
HWY_INLINE bool all_in_range(const Numbers& numbers, std::size_t n, std::int32_t min,
                             std::int32_t max) {
  std::int32_t low = 0x7fffffff, high = -0x7fffffff - 1;
  for (std::size_t i = 0; i < n; ++i) {
    low = numbers[i] < low ? numbers[i] : low;
    high = numbers[i] > high ? numbers[i] : high;
  }
  return low >= min && high <= max;
}

// Byte shuffles and shifts that extract four k-bit numbers from 16 bytes, by k and the start bit of
// the first. The start bit repeats after two groups of four.
struct UnpackTable {
  static constexpr int kMaxBits = 25;  // wider numbers may span five bytes
  struct Entry {
    alignas(16) std::array<std::uint8_t, 16> bytes;
    alignas(16) std::array<std::uint32_t, 4> shifts;
  };
  std::array<std::array<Entry, 8>, kMaxBits + 1> entries{};
};

constexpr UnpackTable unpack_table() {
  UnpackTable table{};
  for (std::size_t k = 0; k < table.entries.size(); ++k)
    for (std::size_t start = 0; start < 8; ++start)
      for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t bit = start + i * k;
        table.entries[k][start].shifts[i] = static_cast<std::uint32_t>(bit % 8);
        for (std::size_t j = 0; j < 4; ++j)
          table.entries[k][start].bytes[4 * i + j] =
              static_cast<std::uint8_t>(bit / 8 + j < 16 ? bit / 8 + j : 0x80);
      }
  return table;
}

constexpr UnpackTable kUnpackTable = unpack_table();

#if HWY_TARGET == HWY_SCALAR
HWY_INLINE void unpack(const std::byte* bytes, std::size_t bit, int k, std::uint32_t base,
                       std::int32_t* values, std::size_t count) {
  BitReader::unpack_one_by_one(bytes, bit, k, base, values, count);
}
#else
HWY_INLINE void unpack(const std::byte* bytes, std::size_t bit, int k, std::uint32_t base,
                       std::int32_t* HWY_RESTRICT values, std::size_t count) {
  if (k > UnpackTable::kMaxBits)
    return BitReader::unpack_one_by_one(bytes, bit, k, base, values, count);
  const hn::Full128<std::uint32_t> d;
  const hn::Full128<std::uint8_t> d8;
  const auto& by_start = kUnpackTable.entries[static_cast<std::size_t>(k)];
  const auto mask = hn::Set(d, (1u << k) - 1), bases = hn::Set(d, base);
  const auto four = [&](std::size_t at, const UnpackTable::Entry& entry, std::size_t i) {
    const auto raw = hn::LoadU(d8, reinterpret_cast<const std::uint8_t*>(bytes) + at / 8);
    const auto words =
        hn::BitCast(d, hn::TableLookupBytesOr0(raw, hn::Load(d8, entry.bytes.data())));
    const auto numbers = hn::And(hn::Shr(words, hn::Load(d, entry.shifts.data())), mask);
    hn::StoreU(hn::Add(numbers, bases), d, reinterpret_cast<std::uint32_t*>(values) + i);
  };
  const std::size_t step = 4 * static_cast<std::size_t>(k);
  const auto &even = by_start[bit % 8], &odd = by_start[(bit + step) % 8];
  // May write beyond the last value; columns have room.
  for (std::size_t i = 0; i < count; i += 8, bit += 2 * step) {
    four(bit, even, i);
    if (i + 4 < count) four(bit + step, odd, i + 4);
  }
}
#endif

// Positions of the set bits of every byte.
constexpr auto kOnesOfByte = [] {
  std::array<std::array<std::uint8_t, 8>, 256> ones{};
  for (std::size_t byte = 0; byte < ones.size(); ++byte)
    for (std::size_t bit = 0, n = 0; bit < 8; ++bit)
      if ((byte >> bit & 1) != 0) ones[byte][n++] = static_cast<std::uint8_t>(bit);
  return ones;
}();

// Writes eight positions per byte without a branch; the next byte overwrites the unused ones.
#if HWY_TARGET == HWY_SCALAR
HWY_INLINE void find_ones(std::uint64_t word, std::uint32_t from, std::uint16_t* ones) {
  BitReader::find_ones_one_by_one(word, from, ones);
}
#else
HWY_INLINE void find_ones(std::uint64_t word, std::uint32_t from,
                          std::uint16_t* HWY_RESTRICT ones) {
  // Number of ones in each byte, then its prefix sums.
  std::uint64_t counts = word - (word >> 1 & 0x5555'5555'5555'5555u);
  counts = (counts & 0x3333'3333'3333'3333u) + (counts >> 2 & 0x3333'3333'3333'3333u);
  counts = ((counts + (counts >> 4)) & 0x0f0f'0f0f'0f0f'0f0fu) * 0x0101'0101'0101'0101u;
  const hn::Full64<std::uint8_t> d8;
  const hn::Full128<std::uint16_t> d;
  const auto bits_of_byte = hn::Set(d, 8);
  auto first = hn::Set(d, static_cast<std::uint16_t>(from));
  counts <<= 8;
  for (int byte = 0; byte < 8; ++byte, word >>= 8, counts >>= 8) {
    const auto places = hn::PromoteTo(d, hn::LoadU(d8, kOnesOfByte[word & 255].data()));
    hn::StoreU(hn::Add(places, first), d, ones + (counts & 255));
    first = hn::Add(first, bits_of_byte);
  }
}
#endif

// Writes up to three values beyond `count`.
HWY_NOINLINE void read_column(PageWorkspace& w, std::int32_t* numbers, std::size_t count) {
  w.bits.get_column(
      numbers, count, [](auto... arguments) { unpack(arguments...); },
      [](auto... arguments) { find_ones(arguments...); });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
