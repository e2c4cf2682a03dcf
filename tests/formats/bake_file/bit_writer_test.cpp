#include "formats/bake_file/bit_writer.h"

#include <array>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "formats/bake_file/bit_reader.h"

namespace clamor {
namespace {

using Numbers = std::vector<std::int32_t>;

constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min();
constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();

std::vector<std::byte> with_slack(std::vector<std::byte> bytes) {
  bytes.resize(bytes.size() + BitReader::kSlackBytes, std::byte{0xff});
  return bytes;
}

// Columns that are constant, narrow, wide, one-sided or two-sided geometric, and with outliers.
Numbers column(std::uint32_t round) {
  const RandomBits shape = philox(1, {round, 0, 0, 0});
  const std::size_t count = shape[0] % 513;
  const int bits = static_cast<int>(shape[1] % 33);
  Numbers numbers;
  for (std::uint32_t i = 0; i < count; ++i) {
    const RandomBits a = philox(1, {round, 1, i, 0});
    std::uint32_t value = bits == 0 ? 0 : a[0] >> (32 - bits);
    if (shape[2] % 4 == 1) value = static_cast<std::uint32_t>(std::countl_zero(a[1] | 1));
    if (shape[2] % 4 == 2) value >>= std::countl_zero(a[1] | 1);
    if (shape[2] % 4 == 3 && (a[2] & 1) != 0) value = 0u - value;
    if (shape[3] % 8 == 0 && a[3] % 100 == 0) value = a[1];
    numbers.push_back(static_cast<std::int32_t>(value + (shape[3] % 3 == 0 ? shape[1] : 0)));
  }
  return numbers;
}

TEST(BitWriter, RoundTrips) {
  for (std::uint32_t round = 0; round < 2000; ++round) {
    const Numbers a = column(2 * round), b = column(2 * round + 1);
    BitWriter writer;
    writer.put(round % 8, 3);
    writer.put_column(a);
    writer.put_signed(-5, 7);
    writer.put_column(b);
    const auto bytes = writer.take();
    const std::uint64_t bits = 10 + column_bits(a) + column_bits(b);
    EXPECT_EQ(bytes.size(), (bits + 7) / 8);

    const auto all = with_slack(bytes);
    BitReader reader{std::span(all).first(bytes.size())};
    Numbers a_again(a.size()), b_again(b.size());
    EXPECT_EQ(reader.get(3), round % 8);
    reader.get_column(a_again.data(), a_again.size());
    EXPECT_EQ(reader.get_signed(7), -5);
    reader.get_column(b_again.data(), b_again.size());
    EXPECT_TRUE(reader.at_end());
    ASSERT_EQ(a_again, a) << round;
    ASSERT_EQ(b_again, b) << round;
  }
}

TEST(BitWriter, RoundTripsExtremes) {
  for (const Numbers& numbers :
       {Numbers{kMin}, Numbers{kMax}, Numbers{kMin, kMax}, Numbers{kMax, 0, kMin},
        Numbers{kMin, kMin, kMin}, Numbers{-1, 0, 1, -2}, Numbers(512, kMax)}) {
    BitWriter writer;
    writer.put_column(numbers);
    const auto bytes = writer.take(), all = with_slack(bytes);
    BitReader reader{std::span(all).first(bytes.size())};
    Numbers again(numbers.size());
    reader.get_column(again.data(), again.size());
    EXPECT_TRUE(reader.at_end());
    EXPECT_EQ(again, numbers);
  }
}

// A Rice code is within 0.04 bits of the entropy of a geometric column at its best ratios.
TEST(BitWriter, IsCloseToTheEntropyOfAGeometricColumn) {
  Numbers numbers;
  constexpr std::uint32_t kCount = 512;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    // P(n) = 2^-(n / 4 + 1) / 4: a unary part with ratio 1/2 and two uniform bits.
    const RandomBits a = philox(3, {i, 0, 0, 0});
    numbers.push_back(4 * std::countr_zero(a[0] | 0x80000000u) +
                      static_cast<std::int32_t>(a[1] % 4));
  }
  // 2 bits for the unary part and 2 uniform bits; the standard error of 512 draws is 0.06.
  EXPECT_NEAR(static_cast<double>(column_bits(numbers)) / kCount, 4.0, 0.2 + 12.0 / kCount);
}

TEST(BitReader, NeverReadsBeyondItsEnd) {
  std::size_t refused = 0;
  for (std::uint32_t round = 0; round < 3000; ++round) {
    const std::size_t size = philox(4, {round, 0, 0, 0})[0] % 40;
    // Exact size, so that sanitizers detect reads beyond it.
    std::vector<std::byte> bytes(size + BitReader::kSlackBytes);
    for (std::uint32_t i = 0; i < bytes.size(); ++i)
      bytes[i] =
          static_cast<std::byte>(philox(4, {round, 1, i, 0})[0] & (round % 3 == 0 ? 3 : 255));
    BitReader reader{std::span(bytes).first(size)};
    std::array<std::int32_t, BitReader::kMaxColumnValues> numbers{};
    for (int columns = 0; columns < 4; ++columns)
      reader.get_column(numbers.data(), 1 + philox(4, {round, 2, 0, 0})[0] % numbers.size());
    refused += reader.ok() ? 0 : 1;
    if (!reader.ok()) {
      EXPECT_FALSE(reader.at_end());
      EXPECT_EQ(reader.get(8), 0u);
    }
  }
  EXPECT_GT(refused, 1500u);
}

}  // namespace
}  // namespace clamor
