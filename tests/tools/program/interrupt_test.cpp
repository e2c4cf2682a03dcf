#include "tools/program/interrupt.h"

#include <csignal>
#include <cstdint>

#include <gtest/gtest.h>

namespace clamor {
namespace {

std::int64_t time_ms = 1'000;
std::int64_t now_ms() { return time_ms; }

// `timeout` sends one to the program and one to its process group.
TEST(Interrupt, TakesTwoSignalsAtOnceForOneRequest) {
  const Interrupt interrupt(now_ms);
  std::raise(SIGTERM);
  time_ms += 499;
  std::raise(SIGTERM);
  EXPECT_TRUE(Interrupt::requested());
}

TEST(InterruptDeathTest, EndsTheProgramAtASecondRequest) {
  EXPECT_EXIT(
      {
        const Interrupt interrupt(now_ms);
        std::raise(SIGTERM);
        time_ms += 500;
        std::raise(SIGTERM);
      },
      ::testing::KilledBySignal(SIGTERM), "");
}

}  // namespace
}  // namespace clamor
