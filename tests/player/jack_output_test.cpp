// jack_output_test.cpp: JACK devices on a private server.
#include "runtime/output/jack_output.h"

#include <algorithm>
#include <atomic>
#include <thread>

#include <gtest/gtest.h>
#include <signal.h>

#include "tests/player/fake_devices.h"
#include "tests/player/jack.h"
#include "tests/player/jack_listener.h"

namespace clamor {
namespace {

using testing::comes_true;

class JackDevice : public ::testing::Test {
 protected:
  void SetUp() override {
#ifdef __SANITIZE_THREAD__
    GTEST_SKIP() << "JACK's library is not built for ThreadSanitizer";
#endif
    if (const std::string missing = testing::Jack::missing(); !missing.empty())
      GTEST_SKIP() << missing;
  }

  static OutputDevice device(const std::string& name) { return {"jack", name, 2, {48000}, false}; }
};

// Plays 1, 2, 3, ... on the left and the negative on the right. Floats hold integers up to 2^24,
// which is six minutes.
struct Counting {
  std::atomic<std::uint32_t> next{1}, max_frames{0};

  static void fill(void* self, float* output, std::uint32_t frames, bool) noexcept {
    auto& counting = *static_cast<Counting*>(self);
    for (std::uint32_t i = 0; i < frames; ++i) {
      const auto number = static_cast<float>(counting.next.fetch_add(1));
      output[2 * i] = number;
      output[2 * i + 1] = -number;
    }
    counting.max_frames.store(std::max(counting.max_frames.load(), frames));
  }

  OutputCallback callback() { return {&Counting::fill, this}; }
};

// An output that counts, and its listener.
struct CountingOutput {
  explicit CountingOutput(const OutputDevice& device)
      : output(open_jack(device, {}, counting.callback(), problem)) {}
  bool started() const { return listener.connected() && output != nullptr && output->start().ok(); }

  testing::JackListener listener{"listener"};
  Counting counting;
  std::string problem;
  std::unique_ptr<AudioOutput> output;
};

// Otherwise SIGPIPE ends the process if the server dies while another thread than the first to
// open a client asks it.
TEST_F(JackDevice, BlocksTheSignalOfABrokenConnectionInEachThread) {
  const testing::Jack server;
  ASSERT_TRUE(server.ready());
  const testing::JackListener first("first");
  std::thread other([] {
    sigset_t broken, mask;
    ::sigemptyset(&broken);
    ::sigaddset(&broken, SIGPIPE);
    ::pthread_sigmask(SIG_UNBLOCK, &broken, nullptr);
    EXPECT_FALSE(jack_devices().empty());
    ::pthread_sigmask(SIG_BLOCK, nullptr, &mask);
    EXPECT_EQ(::sigismember(&mask, SIGPIPE), 1);
  });
  other.join();
}

TEST_F(JackDevice, IsListedAsTheServerHasIt) {
  const testing::Jack server(44100, 128);
  ASSERT_TRUE(server.ready());
  const testing::JackListener listener("a listener");
  const auto devices = jack_devices();
  ASSERT_EQ(devices.size(), 2u);
  EXPECT_EQ(devices[0].full_name(), "jack: system");
  EXPECT_EQ(devices[0].output_channels, 2);
  EXPECT_EQ(devices[0].rates_hz, std::vector<unsigned>{44100});
  EXPECT_TRUE(devices[0].is_default);
  EXPECT_EQ(devices[1].full_name(), "jack: a listener");
  EXPECT_FALSE(devices[1].is_default);
  // The player uses RtAudio for other APIs, but not for JACK.
  const auto all = sound_devices()->devices("jack");
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].full_name(), devices[0].full_name());
}

TEST_F(JackDevice, SaysWhyItCannotBeOpened) {
  const auto problem = [](const std::string& name, const OutputRequest& request) {
    std::string why;
    Counting counting;
    EXPECT_EQ(open_jack(device(name), request, counting.callback(), why), nullptr);
    return why;
  };
  {
    const testing::Jack server(44100, 128);
    ASSERT_TRUE(server.ready());
    EXPECT_EQ(problem("system", {"", 6}), "it has 2");
    EXPECT_EQ(problem("system", {"", 2, 256, 48000}), "its server runs at 44100 Hz");
    EXPECT_EQ(problem("other", {}), "it is gone");
  }
  EXPECT_EQ(problem("system", {}), "it is gone");
  EXPECT_TRUE(jack_devices().empty());
}

// RtAudio's own JACK layer stops at the first change, and hangs when it is closed.
TEST_F(JackDevice, HearsEachFrameOnceWhileTheServerChangesTheSizeOfItsBlocks) {
  const testing::Jack server;
  ASSERT_TRUE(server.ready());
  CountingOutput player(device("listener"));
  ASSERT_TRUE(player.started()) << player.problem;
  const Counting& counting = player.counting;
  testing::JackListener& listener = player.listener;
  for (const unsigned frames : {256u, 64u, 1024u, 16u, 4096u, 512u}) {
    listener.set_block_frames(frames);
    const std::uint32_t before = counting.next;
    ASSERT_TRUE(comes_true([&] { return counting.next > before + 8 * frames + 4000; })) << frames;
    EXPECT_EQ(player.output->block_frames(), static_cast<int>(frames));
    EXPECT_GE(player.output->latency_s(), frames / 48000.0);  // a block filled now comes next
    EXPECT_EQ(player.output->failure(), "");
  }
  EXPECT_EQ(counting.max_frames, 4096u);
  player.output->stop();
  const std::uint32_t played = counting.next - 1;

  std::uint32_t heard = 0;
  for (std::size_t i = 0; i < listener.frames(); ++i) {
    const float number = listener.left(i);
    if (number == 0) continue;  // before the start, and while the server changes
    ASSERT_EQ(number, static_cast<float>(++heard)) << "frame " << i;
    ASSERT_EQ(listener.right(i), -number) << "frame " << i;
  }
  EXPECT_GE(heard + 512, played);  // the last block may not have reached the listener
}

// With blocks of a millisecond some pass before the connections are made.
TEST_F(JackDevice, HearsTheFirstFrame) {
  const testing::Jack server(48000, 64);
  ASSERT_TRUE(server.ready());
  for (int i = 0; i < 5; ++i) {
    CountingOutput player(device("listener"));
    ASSERT_TRUE(player.started()) << player.problem;
    ASSERT_TRUE(comes_true([&] { return player.counting.next > 4000; }));
    player.output->stop();
    const testing::JackListener& listener = player.listener;
    std::size_t first = 0;
    while (first < listener.frames() && listener.left(first) == 0) ++first;
    ASSERT_LT(first, listener.frames());
    EXPECT_EQ(listener.left(first), 1);
  }
}

TEST_F(JackDevice, SaysThatItsServerHasStopped) {
  testing::Jack server;
  ASSERT_TRUE(server.ready());
  Counting counting;
  std::string problem;
  auto output = open_jack(device("system"), {}, counting.callback(), problem);
  ASSERT_NE(output, nullptr) << problem;
  ASSERT_TRUE(output->start().ok());
  ASSERT_TRUE(comes_true([&] { return counting.next > 1; }));
  EXPECT_EQ(output->failure(), "");
  server.kill();
  EXPECT_TRUE(comes_true([&] { return output->failure() == "the JACK server has stopped"; }));
  output.reset();  // does not hang
}

}  // namespace
}  // namespace clamor
