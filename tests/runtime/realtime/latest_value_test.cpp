// latest_value_test.cpp: the lock-free queues between threads, in ten million random interleavings
// each, and under ThreadSanitizer, which sees orders that this machine does not show.
#include "runtime/realtime/latest_value.h"

#include <array>
#include <atomic>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "runtime/realtime/sample_ring.h"
#include "runtime/voices/keyframe_queue.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

// Number of operations of one side during which the other side may be anywhere.
constexpr std::uint64_t kMeetings = testing::kSanitized ? 300'000 : 10'000'000;

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

TEST(KeyframeQueue, DeliversEveryKeyframeOnceAndInOrder) {
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

// Blocks of 1 to 7 samples arrive whole and in order, or are counted as dropped.
TEST(SampleRing, DeliversEverySampleThatFitsAndCountsTheOthers) {
  SampleRing ring(61);
  std::atomic<bool> done{false};
  std::uint64_t sent = 0;
  std::thread writer([&] {
    Jitter jitter(5);
    std::minstd_rand random(7);
    SpinThenYield patience;
    std::uint32_t next = 0;
    for (std::uint64_t i = 0; i < kMeetings; ++i) {
      std::array<float, 7> block;
      const std::size_t size = 1 + random() % 7;
      for (std::size_t s = 0; s < size; ++s) block[s] = static_cast<float>((next + s) % 9973);
      const std::uint64_t dropped = ring.dropped();
      ring.write(std::span(block).first(size));
      sent += size;
      if (ring.dropped() == dropped)
        next += static_cast<std::uint32_t>(size);
      else
        patience.in_vain();
      jitter();
    }
    done = true;
  });
  Jitter jitter(6);
  SpinThenYield patience;
  std::array<float, 11> block;
  std::uint64_t got = 0;
  for (bool last = false;;) {
    const std::size_t count = ring.read(block);
    for (std::size_t s = 0; s < count; ++s)
      ASSERT_EQ(block[s], static_cast<float>((got + s) % 9973));
    got += count;
    if (count == 0) {
      if (last) break;
      last = done;
      patience.in_vain();
    }
    jitter();
  }
  writer.join();
  EXPECT_EQ(got + ring.dropped(), sent);
  EXPECT_GT(got, 1000u);
}

TEST(SampleRing, DropsAndCountsBlocksThatDoNotFit) {
  SampleRing ring(4);
  const std::array<float, 3> block = {1, 2, 3};
  ring.write(block);
  ring.write(block);
  EXPECT_EQ(ring.dropped(), 3u);
  std::array<float, 8> read;
  EXPECT_EQ(ring.read(read), 3u);
}

}  // namespace
}  // namespace clamor
