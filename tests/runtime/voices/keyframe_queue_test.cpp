#include "runtime/voices/keyframe_queue.h"

#include <array>
#include <atomic>
#include <thread>

#include <gtest/gtest.h>

#include "tests/runtime/interleaving.h"

namespace clamor {
namespace {

using testing::Jitter;
using testing::kMeetings;
using testing::SpinThenYield;

TEST(KeyframeQueue, DeliversEveryKeyframeOnceAndInOrder_NoAsan) {
  KeyframeQueue queue(4, 8);
  std::atomic<bool> done{false};
  std::atomic<std::uint64_t> published{0};
  std::thread writer([&] {
    Jitter jitter(3);
    SpinThenYield patience;
    std::uint64_t next = 1;
    // A minimum number of keyframes, even if the reader gets no time for long.
    for (std::uint64_t i = 0; i < kMeetings || next <= 2000; ++i) {
      if (Keyframe* const keyframe = queue.writable()) {
        keyframe->number = next;
        keyframe->voices.assign(next % 8, Voice{static_cast<std::uint32_t>(next)});
        queue.publish();
        ++next;
      } else {
        patience.in_vain();
      }
      jitter();
    }
    published = next - 1;
    done = true;
  });
  Jitter jitter(4);
  SpinThenYield patience;
  std::uint64_t expected = 1;
  while (!done || expected <= published) {
    const Keyframe* const keyframe = queue.readable();
    if (keyframe == nullptr) {
      patience.in_vain();
      jitter();
      continue;
    }
    ASSERT_LE(queue.size(), 4u);
    ASSERT_EQ(keyframe->number, expected);
    ASSERT_EQ(keyframe->voices.size(), expected % 8);
    jitter();
    for (const Voice& voice : keyframe->voices)
      ASSERT_EQ(voice.slot, static_cast<std::uint32_t>(expected));
    queue.release();
    ++expected;
  }
  writer.join();
  EXPECT_EQ(queue.size(), 0u);
  EXPECT_GT(published, 1000u);
}

}  // namespace
}  // namespace clamor
