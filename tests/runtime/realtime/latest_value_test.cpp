#include "runtime/realtime/latest_value.h"

#include <array>
#include <atomic>
#include <thread>

#include <gtest/gtest.h>

#include "tests/runtime/interleaving.h"

namespace clamor {
namespace {

using testing::Jitter;
using testing::kMeetings;

struct Torn {
  std::array<std::uint64_t, 16> copies{};
};

TEST(LatestValue, IsNeverTornAndNeverGoesBack) {
  LatestValue<Torn> value;
  std::atomic<std::uint64_t> seen{0}, newest{0};
  std::thread writer([&] {
    Jitter jitter(1);
    std::uint64_t i = 0;
    // both threads run at the same time
    while (i < kMeetings || seen.load(std::memory_order_relaxed) < 100) {
      Torn torn;
      torn.copies.fill(++i);
      value.publish(torn);
      jitter();
    }
    newest = i;
  });
  Jitter jitter(2);
  std::uint64_t last = 0;
  while (newest == 0 || last != newest) {
    const Torn& torn = value.latest();
    const std::uint64_t first = torn.copies[0];
    jitter();  // the reference holds until the next call, whatever is published meanwhile
    for (const auto copy : torn.copies) ASSERT_EQ(copy, first);
    ASSERT_GE(first, last);
    seen.fetch_add(first != last, std::memory_order_relaxed);
    last = first;
  }
  writer.join();
}

}  // namespace
}  // namespace clamor
