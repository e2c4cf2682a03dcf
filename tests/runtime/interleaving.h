// interleaving.h: shifts two threads of a test against each other.
#pragma once

#include <cstdint>
#include <random>
#include <thread>

#include "tests/sanitized.h"

namespace clamor::testing {

// Number of operations of one side during which the other side may be anywhere. ThreadSanitizer
// sees a race at any meeting; without it, a race must do harm, which takes some more.
inline constexpr std::uint64_t kMeetings = kSanitized ? 300'000 : 400'000;

// Shifts the two threads against each other, so that they meet at every point: usually in step,
// sometimes by a slip of some tens of instructions, rarely with another thread in between.
class Jitter {
 public:
  explicit Jitter(unsigned seed) : random_(seed) {}
  void operator()() {
    const auto draw = random_();
    if (draw % 4 == 0)
      for (volatile unsigned spin = draw >> 8 & 31; spin > 0;) spin = spin - 1;
    if (draw % 8192 == 0) std::this_thread::yield();
  }

 private:
  std::minstd_rand random_;
};

// Yields the core after some failed attempts, in case the other side waits for it.
class SpinThenYield {
 public:
  void in_vain() {
    if (++tries_ % 16 == 0) std::this_thread::yield();
  }

 private:
  unsigned tries_ = 0;
};

}  // namespace clamor::testing
