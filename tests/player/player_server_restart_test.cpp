// player_server_restart_test.cpp: sound servers that are killed and restarted under the player:
// PulseAudio, JACK, and PulseAudio behind ALSA.
//
// PulseAudio is restarted fifty times, which takes most of a minute; less often under sanitizers
// and for the other servers; CLAMOR_RESTARTS times if that is set.
#include <cstdlib>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer_statistics.h"
#include "runtime/output/supervised_output.h"
#include "runtime/player/player.h"
#include "runtime/player/player_options.h"
#include "runtime/player/player_statistics.h"
#include "tests/baked_room.h"
#include "tests/player/fake_devices.h"
#include "tests/player/jack.h"
#include "tests/player/pulse.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

using testing::comes_true;
using Clock = std::chrono::steady_clock;

// A library may hang with its server; PulseAudio's does not.
template <class Server>
constexpr std::uint64_t kHungClosings = std::is_same_v<Server, testing::Pulse> ? 0 : 1;

template <class Server>
int restarts() {
  const char* const wanted = std::getenv("CLAMOR_RESTARTS");
  if (wanted != nullptr) return std::max(1, std::atoi(wanted));
  if (testing::kSanitized) return 4;
  return std::is_same_v<Server, testing::Pulse> ? 50 : 8;
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

template <class Server>
class SoundServer : public ::testing::Test {
 protected:
  void SetUp() override {
#ifdef __SANITIZE_THREAD__
    GTEST_SKIP() << "sound servers' libraries are not built for ThreadSanitizer; the tests of "
                    "SupervisedOutput have the same threads without them";
#endif
    if (const std::string missing = Server::missing(); !missing.empty()) GTEST_SKIP() << missing;
    server = std::make_unique<Server>();
    ASSERT_TRUE(server->ready());
    PlayerOptions options;
    options.auralizer.voices = 100;
    options.listener = {{4, 5, 1.6}, 0.5, 0};
    options.device = Server::kDevice;
    auto created = Player::create(testing::baked_room(), options);
    ASSERT_TRUE(created.ok()) << created.error().message;
    player = std::move(*created);
    ASSERT_TRUE(player->start().ok());
    ASSERT_TRUE(server->sounds());
  }

  OutputStatistics output() { return player->statistics().output; }

  std::unique_ptr<Server> server;
  std::unique_ptr<Player> player;
};

using Servers = ::testing::Types<testing::Pulse, testing::Jack, testing::Alsa>;
struct ServerName {
  template <class Server>
  static std::string GetName(int) {
    const std::string device = Server::kDevice;
    return device.substr(0, device.find(':'));
  }
};
TYPED_TEST_SUITE(SoundServer, Servers, ServerName);

TYPED_TEST(SoundServer, ThatIsKilledAndRestartedIsSurvivedAndSoundIsBackEachTime) {
  double longest_s = 0, sum_s = 0;
  const int times = restarts<TypeParam>();
  for (int i = 0; i < times; ++i) {
    this->server->kill();
    // Sometimes longer than any pause between attempts, sometimes no time at all.
    std::this_thread::sleep_for(std::chrono::milliseconds(i % 4 * 350));
    const double before_s = this->player->statistics().time_s;
    const auto start = Clock::now();
    this->server->start();
    ASSERT_TRUE(this->server->ready());
    ASSERT_TRUE(this->server->sounds()) << "restart " << i;
    const double took_s = seconds_since(start);
    EXPECT_GT(this->player->statistics().time_s, before_s);
    EXPECT_TRUE(comes_true([&] {
      const OutputStatistics now = this->output();
      return now.has_device && now.reopenings == now.losses;
    }));
    longest_s = std::max(longest_s, took_s);
    sum_s += took_s;
  }
  const OutputStatistics figures = this->output();
  std::cout << times << " restarts: sound is back after " << sum_s / times
            << " s on average, after " << longest_s << " s at the longest; "
            << figures.failed_openings << " attempts in vain, " << figures.hung_closings
            << " closings hung\n";
  // On a busy machine a server may be so slow that its device is lost once more.
  EXPECT_GE(figures.losses, static_cast<std::uint64_t>(times));
  const auto start = Clock::now();
  EXPECT_TRUE(this->player->stop().ok());
  EXPECT_LT(seconds_since(start), 5);  // does not hang
}

// A hanging server closes no socket: nothing fails or is reported, and RtAudio and libjack hang
// with it.
TYPED_TEST(SoundServer, ThatHangsIsNoticedAndSoundIsBackWhenItGoesOn) {
  this->server->freeze();
  ASSERT_TRUE(comes_true([&] { return this->output().losses == 1; }));
  const double lost_at_s = this->player->statistics().time_s;
  ASSERT_TRUE(comes_true([&] { return this->player->statistics().time_s > lost_at_s + 0.5; }));
  ASSERT_TRUE(comes_true([&] { return this->output().hung_closings == kHungClosings<TypeParam>; }));
  EXPECT_FALSE(this->output().has_device);
  this->server->thaw();
  ASSERT_TRUE(comes_true([&] { return this->output().has_device; }));
  EXPECT_TRUE(this->server->sounds());
  EXPECT_TRUE(this->player->stop().ok());
}

TYPED_TEST(SoundServer, ThatHangsDoesNotKeepThePlayerFromEnding) {
  this->server->freeze();
  const auto start = Clock::now();
  EXPECT_TRUE(this->player->stop().ok());
  EXPECT_LT(seconds_since(start), 5);
  EXPECT_EQ(this->output().hung_closings, kHungClosings<TypeParam>);
  this->player.reset();
  this->server->thaw();
  // The hanging thread calls nothing now.
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
}

}  // namespace
}  // namespace clamor
