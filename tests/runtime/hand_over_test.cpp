// The two ways values travel between threads, under load and under ThreadSanitizer.
#include <array>
#include <thread>

#include <gtest/gtest.h>

#include "runtime/keyframe_queue.h"
#include "runtime/latest_value.h"
#include "runtime/sample_ring.h"

namespace clamor {
namespace {

struct Torn {
  std::array<std::uint64_t, 16> copies{};
};

TEST(LatestValue, IsNeverTornAndNeverGoesBack) {
  LatestValue<Torn> value;
  constexpr std::uint64_t kLast = 300000;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kLast; ++i) {
      Torn torn;
      torn.copies.fill(i);
      value.publish(torn);
    }
  });
  std::uint64_t last = 0;
  while (last != kLast) {
    const Torn& seen = value.latest();
    for (const auto copy : seen.copies) ASSERT_EQ(copy, seen.copies[0]);
    ASSERT_GE(seen.copies[0], last);
    last = seen.copies[0];
  }
  writer.join();
}

TEST(KeyframeQueue, HandsOverEveryKeyframeOnceAndInOrder) {
  KeyframeQueue queue(4, 8);
  constexpr std::uint64_t kLast = 200000;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kLast;) {
      Keyframe* keyframe = queue.writable();
      if (keyframe == nullptr) continue;
      keyframe->number = i;
      keyframe->voices.assign(i % 8, Voice{});
      queue.publish();
      ++i;
    }
  });
  for (std::uint64_t expected = 1; expected <= kLast;) {
    const Keyframe* keyframe = queue.readable();
    if (keyframe == nullptr) continue;
    ASSERT_EQ(keyframe->number, expected);
    ASSERT_EQ(keyframe->voices.size(), expected % 8);
    queue.release();
    ++expected;
  }
  writer.join();
}

TEST(SampleRing, CarriesEverySampleThatFits) {
  SampleRing ring(1000);
  constexpr int kBlocks = 30000;
  std::thread writer([&] {
    for (int i = 0; i < kBlocks; ++i) {
      const std::array<float, 3> block = {static_cast<float>(i), 0.5f, -1.0f};
      for (std::uint64_t dropped = ring.dropped();;) {
        ring.write(block);
        if (ring.dropped() == dropped) break;
        dropped = ring.dropped();
      }
    }
  });
  std::array<float, 3> read;
  for (int i = 0; i < kBlocks; ++i) {
    for (std::size_t got = 0; got < 3;) got += ring.read(std::span(read).subspan(got));
    ASSERT_EQ(read[0], static_cast<float>(i));
    ASSERT_EQ(read[2], -1.0f);
  }
  writer.join();
}

TEST(SampleRing, DropsAndCountsWhatDoesNotFit) {
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
