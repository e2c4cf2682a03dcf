// A sound server that is killed and started again under the player.
//
// Fifty times, which takes most of a minute; a few where a sanitizer watches; CLAMOR_RESTARTS of
// them where that is set.
#include <cstdlib>

#include <gtest/gtest.h>

#include "runtime/player.h"
#include "tests/player/fake_devices.h"
#include "tests/player/pulse.h"
#include "tests/rooms_runtime.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

using testing::comes_true;
using Clock = std::chrono::steady_clock;

constexpr double kBackWithin_s = 2;

int restarts() {
  const char* const wanted = std::getenv("CLAMOR_RESTARTS");
  if (wanted != nullptr) return std::max(1, std::atoi(wanted));
  return testing::kSanitized ? 4 : 50;
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class SoundServer : public ::testing::Test {
 protected:
  void SetUp() override {
#ifdef __SANITIZE_THREAD__
    GTEST_SKIP() << "PulseAudio is not built for ThreadSanitizer; the tests of SupervisedOutput "
                    "have the same threads without it";
#endif
    if (!testing::installed("pulseaudio") || !testing::installed("parec"))
      GTEST_SKIP() << "pulseaudio and pulseaudio-utils are not installed";
    pulse = std::make_unique<testing::Pulse>();
    ASSERT_TRUE(pulse->ready());
    PlayerOptions options;
    options.auralizer.voices = 100;
    options.pose = {{4, 5, 1.6}, 0.5, 0};
    options.device = "pulse: clamor";
    auto created = Player::create(testing::baked_room(), options);
    ASSERT_TRUE(created.ok()) << created.error().message;
    player = std::move(*created);
    ASSERT_TRUE(player->start().ok());
    ASSERT_TRUE(pulse->sounds());
  }

  OutputStatistics output() { return player->statistics().output; }

  std::unique_ptr<testing::Pulse> pulse;
  std::unique_ptr<Player> player;
};

TEST_F(SoundServer, ThatIsKilledAndRestartedIsSurvivedAndSoundIsBackWithinTwoSecondsEachTime) {
  double longest_s = 0, sum_s = 0;
  const int times = restarts();
  for (int i = 0; i < times; ++i) {
    pulse->kill();
    // Now and then for longer than any pause between attempts, now and then for no time at all.
    std::this_thread::sleep_for(std::chrono::milliseconds(i % 4 * 350));
    const double before_s = player->statistics().time_s;
    const auto start = Clock::now();
    pulse->start();
    ASSERT_TRUE(pulse->ready());
    ASSERT_TRUE(pulse->sounds()) << "restart " << i;
    const double took_s = seconds_since(start);
    EXPECT_LT(took_s, kBackWithin_s) << "restart " << i;
    EXPECT_GT(player->statistics().time_s, before_s);
    EXPECT_TRUE(
        comes_true([&] { return output().reopenings == static_cast<std::uint64_t>(i) + 1; }));
    longest_s = std::max(longest_s, took_s);
    sum_s += took_s;
  }
  const OutputStatistics figures = output();
  std::cout << times << " restarts: sound is back after " << sum_s / times
            << " s on average, after " << longest_s << " s at the longest; "
            << figures.failed_openings << " attempts in vain, " << figures.hung_closings
            << " closings hung\n";
  EXPECT_EQ(figures.losses, static_cast<std::uint64_t>(times));
  const auto start = Clock::now();
  EXPECT_TRUE(player->stop().ok());
  EXPECT_LT(seconds_since(start), 5);  // it hangs on nothing
}

// One that hangs closes no socket: nothing fails, nothing is said, and RtAudio hangs with it.
TEST_F(SoundServer, ThatHangsIsNoticedAndSoundIsBackWhenItGoesOn) {
  pulse->freeze();
  ASSERT_TRUE(comes_true([&] { return output().losses == 1; }));
  const double lost_at_s = player->statistics().time_s;
  ASSERT_TRUE(comes_true([&] { return player->statistics().time_s > lost_at_s + 0.5; }));
  ASSERT_TRUE(comes_true([&] { return output().hung_closings == 1; }));
  EXPECT_FALSE(output().has_device);
  pulse->thaw();
  ASSERT_TRUE(comes_true([&] { return output().has_device; }));
  EXPECT_TRUE(pulse->sounds());
  EXPECT_TRUE(player->stop().ok());
}

TEST_F(SoundServer, ThatHangsDoesNotKeepThePlayerFromEnding) {
  pulse->freeze();
  const auto start = Clock::now();
  EXPECT_TRUE(player->stop().ok());
  EXPECT_LT(seconds_since(start), 5);
  EXPECT_EQ(output().hung_closings, 1u);
  player.reset();
  pulse->thaw();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // what hung calls nobody now
}

}  // namespace
}  // namespace clamor
