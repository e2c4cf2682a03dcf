#include "runtime/engine/memory_budget.h"

#include <gtest/gtest.h>

namespace clamor {
namespace {

constexpr std::uint64_t kMB = 1'000'000;

TEST(MemoryBudget, HoldsAllSoundsByDefaultUpToABound) {
  for (const std::uint64_t all : {0 * kMB, 3 * kMB, 43 * kMB, 256 * kMB}) {
    EXPECT_EQ(MemoryBudget::of(0, all).sounds, all);
    EXPECT_EQ(MemoryBudget::of(0, all).pages, 64 * kMB);
  }
  EXPECT_EQ(MemoryBudget::of(0, 3000 * kMB).sounds, 256 * kMB);
}

TEST(MemoryBudget, GivesSoundsUpToHalfOfAGivenMemory) {
  EXPECT_EQ(MemoryBudget::of(80 * kMB, 43 * kMB).sounds, 40 * kMB);
  EXPECT_EQ(MemoryBudget::of(80 * kMB, 43 * kMB).pages, 40 * kMB);
  EXPECT_EQ(MemoryBudget::of(100 * kMB, 43 * kMB).sounds, 43 * kMB);
  EXPECT_EQ(MemoryBudget::of(100 * kMB, 43 * kMB).pages, 57 * kMB);
}

TEST(MemoryBudget, HoldsALongWholeSoundHoweverLittleMemoryIsGiven) {
  EXPECT_EQ(MemoryBudget::of(1, 43 * kMB).sounds, 8 * kMB);
  EXPECT_EQ(MemoryBudget::of(1, 43 * kMB).pages, 1u);
}

}  // namespace
}  // namespace clamor
