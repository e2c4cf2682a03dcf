#include "common/random.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clamor {
namespace {

using ::testing::ElementsAre;

// Known answers for philox4x32-10 published with Random123 1.14 (its tests/kat_vectors); the last
// counter and key are digits of pi.
TEST(Philox, GivesTheKnownAnswersOfRandom123) {
  EXPECT_THAT(philox(0, {0, 0, 0, 0}), ElementsAre(0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8));
  EXPECT_THAT(philox(0xffffffffffffffff, {0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}),
              ElementsAre(0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd));
  EXPECT_THAT(philox(0x299f31d0a4093822, {0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}),
              ElementsAre(0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1));
}

TEST(Philox, GivesTheSameInLanes) {
  std::array<std::array<std::uint32_t, 8>, 4> lanes;
  for (std::uint32_t word = 0; word < 4; ++word)
    for (std::uint32_t i = 0; i < 8; ++i) lanes[word][i] = 0x9e3779b9u * (8 * word + i);
  const auto counters = lanes;
  philox_lanes(0x299f31d0a4093822, lanes);
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_THAT(philox(0x299f31d0a4093822,
                       {counters[0][i], counters[1][i], counters[2][i], counters[3][i]}),
                ElementsAre(lanes[0][i], lanes[1][i], lanes[2][i], lanes[3][i]));
}

TEST(Unit, ReachesItsClosedEndAndNeverItsOpenOne) {
  EXPECT_EQ(unit(0), 0);
  EXPECT_LT(unit(0xffffffff), 1);
  EXPECT_GT(unit_above_zero(0), 0);
  EXPECT_EQ(unit_above_zero(0xffffffff), 1);
}

}  // namespace
}  // namespace clamor
