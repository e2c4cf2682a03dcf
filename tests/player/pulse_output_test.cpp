// pulse_output_test.cpp: PulseAudio devices on a private server, and the growth of their buffer.
#include "runtime/output/pulse_output.h"

#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "runtime/output/buffer_growth.h"
#include "runtime/output/supervised_output.h"
#include "tests/player/fake_devices.h"
#include "tests/player/pulse.h"

namespace clamor {
namespace {

using testing::comes_true;

class PulseDevice : public ::testing::Test {
 protected:
  void SetUp() override {
#ifdef __SANITIZE_THREAD__
    GTEST_SKIP() << "PulseAudio's library is not built for ThreadSanitizer";
#endif
    if (const std::string missing = testing::Pulse::missing(); !missing.empty())
      GTEST_SKIP() << missing;
    server = std::make_unique<testing::Pulse>();
    ASSERT_TRUE(server->ready());
  }

  std::unique_ptr<AudioOutput> open(const OutputRequest& request, OutputCallback callback) {
    return open_pulse({"pulse", "clamor", 2, {48000}, false}, request, callback, problem);
  }

  std::unique_ptr<testing::Pulse> server;
  std::string problem;
};

// A mixer that takes a given time.
struct SlowMixer {
  std::atomic<int> takes_ms{0};
  std::atomic<std::uint64_t> blocks{0};

  OutputCallback callback() {
    return {[](void* self, float* output, std::uint32_t frames, bool) noexcept {
              auto& mixer = *static_cast<SlowMixer*>(self);
              std::fill_n(output, 2 * std::size_t{frames}, 0.5f);
              std::this_thread::sleep_for(std::chrono::milliseconds(mixer.takes_ms));
              ++mixer.blocks;
            },
            this};
  }
};

// The server may run dry between two callbacks that are both in time.
TEST_F(PulseDevice, CountsEachTimeThatTheServerRanDry) {
  SlowMixer mixer;
  auto opened =
      SupervisedOutput::open(sound_devices(), {testing::Pulse::kDevice, 2, 256}, mixer.callback());
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  SupervisedOutput& output = **opened;
  output.start();
  const auto underflows = [&] { return output.statistics().callbacks.underflows; };
  for (std::uint64_t times = 1; times <= 3; ++times) {
    const std::uint64_t before = underflows();
    mixer.takes_ms = 60;  // for 5 ms of sound, with four blocks buffered
    EXPECT_TRUE(comes_true([&] { return underflows() > before; }));
    mixer.takes_ms = 0;
    const std::uint64_t blocks = mixer.blocks;
    ASSERT_TRUE(comes_true([&] { return mixer.blocks > blocks + 100; }));
  }
  EXPECT_EQ(output.statistics().losses, 0u);
}

TEST_F(PulseDevice, HoldsMoreSoundAfterTheServerRanDryTwiceWhereItMay) {
  SlowMixer mixer;
  OutputRequest request;
  request.buffer_may_grow = true;
  auto output = open(request, mixer.callback());
  ASSERT_NE(output, nullptr) << problem;
  ASSERT_TRUE(output->start().ok());
  ASSERT_TRUE(comes_true([&] { return mixer.blocks > 20; }));
  constexpr double kFirst_s = 4 * 256 / 48000.0;
  EXPECT_LT(output->latency_s(), 1.5 * kFirst_s);
  const auto mix = [&mixer](int takes_ms, std::uint64_t count) {
    mixer.takes_ms = takes_ms;
    const std::uint64_t before = mixer.blocks;
    return comes_true([&] { return mixer.blocks > before + count; });
  };
  const auto holds_more = [&] { return output->latency_s() > 2 * kFirst_s; };
  for (int i = 0; i < 6 && !holds_more(); ++i) ASSERT_TRUE(mix(60, 3) && mix(0, 40)) << i;
  EXPECT_TRUE(comes_true(holds_more)) << output->latency_s();
}

TEST_F(PulseDevice, TellsTheLatencyOfTheBuffersThatWereAskedFor) {
  for (const int frames : {256, 2048}) {
    SlowMixer mixer;
    auto output = open({"", 2, frames}, mixer.callback());
    ASSERT_NE(output, nullptr) << problem;
    ASSERT_TRUE(output->start().ok());
    ASSERT_TRUE(comes_true([&] { return mixer.blocks > 20; }));
    const double buffer_s = 4.0 * frames / 48000;
    EXPECT_TRUE(comes_true([&] {
      return output->latency_s() > 0.5 * buffer_s && output->latency_s() < 1.5 * buffer_s;
    })) << output->latency_s();
  }
}

TEST_F(PulseDevice, SaysWhyItCannotBeOpenedAndThatItsServerHasStopped) {
  SlowMixer mixer;
  std::string why;
  EXPECT_EQ(open_pulse({"pulse", "other", 2, {48000}, false}, {}, mixer.callback(), why), nullptr);
  EXPECT_EQ(why, "it is gone");
  auto output = open({}, mixer.callback());
  ASSERT_NE(output, nullptr) << problem;
  ASSERT_TRUE(output->start().ok());
  ASSERT_TRUE(comes_true([&] { return mixer.blocks > 1; }));
  EXPECT_EQ(output->failure(), "");
  server->kill();
  EXPECT_TRUE(comes_true([&] { return output->failure() == "the PulseAudio server has stopped"; }));
  output.reset();  // does not hang
  EXPECT_EQ(open({}, mixer.callback()), nullptr);
  EXPECT_EQ(problem, "no PulseAudio server answers");
  EXPECT_TRUE(pulse_devices().empty());
}

TEST(BufferGrowth, WaitsForASecondUnderflowBeforeItMakesLatencyLonger) {
  BufferGrowth growth(256, 48000, true);
  const int first = growth.frames();
  EXPECT_EQ(first, 4 * 256);
  EXPECT_FALSE(growth.underflow(10));
  EXPECT_FALSE(growth.underflow(10.1 + BufferGrowth::kWindow_s));  // each alone
  EXPECT_EQ(growth.frames(), first);
  EXPECT_TRUE(growth.underflow(11 + BufferGrowth::kWindow_s));
  EXPECT_EQ(growth.frames(), first * 3 / 2);
  // The first one with the longer buffer.
  EXPECT_FALSE(growth.underflow(12 + BufferGrowth::kWindow_s));
}

TEST(BufferGrowth, EndsAtItsLongestAndNeverBeginsWithoutLeave) {
  BufferGrowth growth(256, 48000, true), fixed(256, 48000, false), large(8192, 48000, true);
  for (int i = 0; i < 100; ++i) {
    growth.underflow(i);
    EXPECT_FALSE(fixed.underflow(i));
    EXPECT_FALSE(large.underflow(i));  // beyond the maximum from the start
  }
  EXPECT_LE(growth.frames(), BufferGrowth::kLongest_s * 48000);
  EXPECT_GT(growth.frames(), 0.9 * BufferGrowth::kLongest_s * 48000);
  EXPECT_EQ(fixed.frames(), 4 * 256);
  EXPECT_EQ(large.frames(), 4 * 8192);
}

}  // namespace
}  // namespace clamor
