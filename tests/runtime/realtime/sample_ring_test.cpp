#include "runtime/realtime/sample_ring.h"

#include <array>
#include <atomic>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "tests/runtime/interleaving.h"

namespace clamor {
namespace {

using testing::Jitter;
using testing::kMeetings;
using testing::SpinThenYield;

// Blocks of 1 to 7 samples arrive whole and in order, or are counted as dropped.
TEST(SampleRing, DeliversEverySampleThatFitsAndCountsTheOthers_NoAsan) {
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
