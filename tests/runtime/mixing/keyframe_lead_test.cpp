#include "runtime/mixing/keyframe_lead.h"

#include <gtest/gtest.h>

namespace clamor {
namespace {

TEST(KeyframeLead, IsTheTimeAKeyframeTakesPlusAReserveThatGrowsWithStalls) {
  KeyframeLead lead;
  EXPECT_DOUBLE_EQ(lead.seconds(), KeyframeLead::kMinReserve_s);
  for (int i = 0; i < 200; ++i) lead.made(0.002, 0);
  const double quiet_s = lead.seconds();
  EXPECT_NEAR(quiet_s, 0.0025 + KeyframeLead::kMinReserve_s, 1e-9);
  lead.made(0.030, 0);
  EXPECT_GT(lead.seconds(), 0.030);  // a slow keyframe may occur again
  for (int i = 0; i < 200; ++i) lead.made(0.002, 0);
  EXPECT_NEAR(lead.seconds(), quiet_s, 1e-9);
  lead.made(0.002, 3);
  EXPECT_GT(lead.seconds(), quiet_s + 0.9 * KeyframeLead::kMinReserve_s);
  for (std::uint64_t held = 4; held < 100; ++held) lead.made(0.002, held);
  EXPECT_LE(lead.seconds(), 0.0025 + KeyframeLead::kMaxReserve_s + 1e-9);
  for (int i = 0; i < 3000; ++i) lead.made(0.002, 99);
  EXPECT_NEAR(lead.seconds(), quiet_s, 1e-9);
}

TEST(KeyframeLead, AnswersAStallOfASecondWithinItsBoundAndShrinksAgain) {
  KeyframeLead lead;
  for (int i = 0; i < 200; ++i) lead.made(0.002, 0);
  const double quiet_s = lead.seconds();
  lead.made(1, 50);
  EXPECT_EQ(lead.seconds(), KeyframeLead::kMax_s);
  for (int i = 0; i < 1500; ++i) lead.made(0.002, 50);  // half a minute
  EXPECT_NEAR(lead.seconds(), quiet_s, 1e-9);
}

}  // namespace
}  // namespace clamor
