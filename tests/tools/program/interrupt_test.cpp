#include "tools/program/interrupt.h"

#include <csignal>

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace clamor {
namespace {

// `timeout` sends one to the program and one to its process group.
TEST(Interrupt, TakesTwoSignalsAtOnceForOneRequest) {
  const Interrupt interrupt;
  std::raise(SIGTERM);
  std::raise(SIGTERM);
  EXPECT_TRUE(Interrupt::requested());
}

TEST(InterruptDeathTest, EndsTheProgramAtASecondRequest) {
  EXPECT_EXIT(
      {
        const Interrupt interrupt;
        std::raise(SIGTERM);
        std::this_thread::sleep_for(std::chrono::milliseconds(600));
        std::raise(SIGTERM);
      },
      ::testing::KilledBySignal(SIGTERM), "");
}

}  // namespace
}  // namespace clamor
