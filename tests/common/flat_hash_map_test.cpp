#include "common/flat_hash_map.h"

#include <unordered_map>

#include <gtest/gtest.h>

#include "common/random.h"

namespace clamor {
namespace {

TEST(FlatHashMap, HoldsWhatAnOrdinaryMapHolds) {
  FlatHashMap<std::uint32_t> map;
  std::unordered_map<std::uint64_t, std::uint32_t> expected;
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    const RandomBits bits = philox(5, {i, 0, 0, 0});
    // Dense keys, 0 included, and keys that differ in their upper bits only.
    const std::uint64_t key =
        (bits[0] & 1) != 0 ? bits[1] % 5000 : std::uint64_t{bits[1] % 5000} << 48;
    if (i == 10'000) {
      const auto odd = [](std::uint64_t, std::uint32_t value) { return value % 2 != 0; };
      map.erase_if(odd);
      std::erase_if(expected, [&](const auto& entry) { return odd(entry.first, entry.second); });
    }
    map[key] = i;
    expected[key] = i;
    ASSERT_EQ(map.size(), expected.size());
  }
  for (const auto& [key, value] : expected) {
    ASSERT_NE(map.find(key), nullptr) << key;
    EXPECT_EQ(*map.find(key), value) << key;
  }
  for (std::uint64_t key = 5000; key < 6000; ++key) EXPECT_EQ(map.find(key), nullptr);
  map.clear();
  EXPECT_EQ(map.size(), 0u);
  EXPECT_EQ(map.find(0), nullptr);
}

}  // namespace
}  // namespace clamor
