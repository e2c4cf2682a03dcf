#include "runtime/player/player.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <thread>

#include <gtest/gtest.h>

#include "formats/audio/audio_file.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/mixing/resampler.h"
#include "runtime/player/player_options.h"
#include "runtime/player/player_statistics.h"
#include "runtime/player/render.h"
#include "runtime/voices/keyframe.h"
#include "tests/baked_room.h"
#include "tests/player/fake_devices.h"
#include "tests/player/pulse.h"
#include "tests/player/slow_machines.h"
#include "tests/sanitized.h"
#include "tests/temporary_file.h"
#include "tests/walks.h"

namespace clamor {
namespace {

using testing::baked_room;

constexpr double kSeconds = 1.5;
// A program that a sanitizer slows down runs dry with more voices, and then the test tries again.
constexpr int kFewVoices = testing::kSanitized ? 50 : 200;

std::vector<float> offline(const PlayerOptions& options) {
  auto auralizer = Auralizer::create(baked_room(), options.auralizer);
  EXPECT_TRUE(auralizer.ok());
  std::vector<float> all;
  const Walk walk = options.walk ? *options.walk : Walk::standing(options.listener);
  EXPECT_TRUE(render(**auralizer, walk, static_cast<std::uint64_t>(kSeconds * kSampleRate_hz),
                     [&](std::span<const float> block) {
                       all.insert(all.end(), block.begin(), block.end());
                       return Result<void>();
                     })
                  .ok());
  return all;
}

PlayerOptions standing() {
  PlayerOptions options;
  options.auralizer.voices = 200;
  options.auralizer.block_frames = 256;
  options.listener = {{4, 5, 1.6}, 0.5, 0};
  options.seconds = kSeconds;
  return options;
}

PlayerOptions walking() {
  PlayerOptions options = standing();
  options.auralizer.voices = kFewVoices;
  options.walk = testing::across_the_room();
  return options;
}

// Plays to the end and returns the statistics.
PlayerStatistics play(const PlayerOptions& options) {
  auto player = Player::create(baked_room(), options);
  EXPECT_TRUE(player.ok()) << (player.ok() ? "" : player.error().message);
  if (!player.ok()) return {};
  EXPECT_TRUE((*player)->start().ok());
  for (int i = 0; i < 2000 && !(*player)->finished(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE((*player)->finished());
  const PlayerStatistics statistics = (*player)->statistics();
  EXPECT_TRUE((*player)->stop().ok());
  return statistics;
}

// Describes what the player counted because the machine was too busy; "" if nothing ran dry.
std::string ran_dry(const PlayerStatistics& played) {
  if (played.output.callbacks.late == 0 && played.auralizer.held_blocks == 0) return "";
  return std::to_string(played.output.callbacks.late) + " callbacks late, " +
         std::to_string(played.auralizer.held_blocks) + " blocks held";
}

// Like ran_dry(), for recordings and devices that wait, where late sound is as good.
std::string held(const PlayerStatistics& played) {
  return played.auralizer.held_blocks == 0 ? "" : ran_dry(played);
}

// A busy machine makes the player or the sound server run dry, which must not change samples, so
// the attempt is repeated until nothing does. `attempt` returns what ran dry.
template <class Attempt>
void until_nothing_runs_dry(Attempt attempt) {
  for (int i = 1; i <= 8; ++i) {
    const std::string dry = attempt();
    if (dry.empty()) return;
    std::cout << "attempt " << i << ": the machine was busy, " << dry << '\n';
  }
  FAIL() << "the machine was busy in every one of eight attempts";
}

class ThroughPulse : public ::testing::Test {
 protected:
  void SetUp() override {
#ifdef __SANITIZE_THREAD__
    GTEST_SKIP()
        << "PulseAudio is not built for ThreadSanitizer; the tests of Player have the same "
           "threads without it";
#endif
    if (!testing::has("pulseaudio") || !testing::has("parec"))
      GTEST_SKIP() << "pulseaudio and pulseaudio-utils are not installed";
  }

  // Returns how often silence was inserted into `heard`; -1 if it holds anything but `rendered` and
  // silence.
  static int gaps_in(std::span<const float> heard, std::span<const float> rendered) {
    int gaps = 0;
    std::size_t h = 0;
    for (std::size_t r = 0; r < rendered.size();) {
      if (h < heard.size() && heard[h] == rendered[r]) {
        ++h;
        ++r;
        continue;
      }
      const std::size_t start = h;
      while (h < heard.size() && heard[h] == 0) ++h;
      if (h == start) return -1;
      ++gaps;
    }
    return gaps;
  }

  // Compares sample by sample, except for silence that a sound server inserts when it runs dry.
  void expect_heard_is_rendered(PlayerOptions options) {
    testing::Pulse pulse;
    ASSERT_TRUE(pulse.ready());
    options.device = "pulse: clamor";
    const std::vector<float> rendered = offline(options);
    const auto sounds = [](float sample) { return sample != 0; };
    const auto first = std::find_if(rendered.begin(), rendered.end(), sounds);
    ASSERT_NE(first, rendered.end());
    until_nothing_runs_dry([&]() -> std::string {
      PlayerStatistics statistics;
      const auto heard = pulse.heard([&] { statistics = play(options); });
      EXPECT_GT(statistics.output.callbacks.callbacks, 250u);
      if (const std::string dry = ran_dry(statistics); !dry.empty()) return dry;
      const auto first_heard = std::find_if(heard.begin(), heard.end(), sounds);
      EXPECT_NE(first_heard, heard.end());
      const int gaps = gaps_in({first_heard, heard.end()}, {first, rendered.end()});
      EXPECT_GE(gaps, 0) << "another sample than the offline render has";
      if (gaps <= 0) return "";
      return "and the sound server ran dry " + std::to_string(gaps) + " times";
    });
  }
};

TEST_F(ThroughPulse, AStillListenerHearsTheOfflineRenderSampleForSample) {
  expect_heard_is_rendered(standing());
}

TEST_F(ThroughPulse, AScriptedWalkIsHeardAsTheOfflineRenderSampleForSample) {
  expect_heard_is_rendered(walking());
}

TEST_F(ThroughPulse, ListsTheSink) {
  const testing::Pulse pulse;
  ASSERT_TRUE(pulse.ready());
  const auto devices = sound_devices()->devices("pulse");
  EXPECT_TRUE(std::any_of(devices.begin(), devices.end(), [](const OutputDevice& device) {
    return device.api == "pulse" && device.name == "clamor" && device.output_channels == 2;
  }));
}

TEST(Player, RecordsWhatItPlays) {
  PlayerOptions options = walking();
  options.device = "none";
  const testing::TemporaryFile record(".wav");
  options.record = record.path();
  until_nothing_runs_dry([&] {
    const PlayerStatistics played = play(options);
    EXPECT_EQ(played.dropped_samples, 0u);
    return held(played);
  });
  if (HasFatalFailure()) return;
  const auto recorded = read_audio(options.record);  // mean of both channels
  ASSERT_TRUE(recorded.ok());
  const auto rendered = offline(options);
  ASSERT_EQ(recorded->size(), rendered.size() / 2);
  for (std::size_t i = 0; i < recorded->size(); ++i)
    ASSERT_NEAR((*recorded)[i], 0.5f * (rendered[2 * i] + rendered[2 * i + 1]), 1e-6f);
}

// Replaced by the same bake it plays what it would have played, since loops go on where they are.
TEST(Player, GoesOnWithLoopsWhenItsBakeIsReplaced_NoTsan) {
  BakeContents contents = testing::baked_contents(300);
  contents.signals[2] = testing::sine(310);  // a click would begin anew
  const auto file = testing::as_file(contents);
  PlayerOptions options = standing();
  options.walk = Walk::standing(options.listener);
  options.device = "none";
  const testing::TemporaryFile record(".wav");
  options.record = record.path();
  until_nothing_runs_dry([&]() -> std::string {
    auto player = Player::create(file, options);
    if (!player.ok() || !(*player)->start().ok()) return "it does not start";
    const auto has_played = [&] { return (*player)->statistics().time_s > 0.4; };
    EXPECT_TRUE(testing::comes_true(has_played));
    const std::string before = held((*player)->statistics());
    EXPECT_TRUE((*player)->replace(file, options.auralizer).ok());
    const bool is_late = (*player)->statistics().time_s > kSeconds - 0.4;
    EXPECT_TRUE(testing::comes_true([&] { return (*player)->finished(); }));
    const PlayerStatistics played = (*player)->statistics();
    EXPECT_TRUE((*player)->stop().ok());
    return before + held(played) + (is_late ? "replaced late" : "");
  });
  if (HasFatalFailure()) return;
  const auto recorded = read_audio(options.record);
  ASSERT_TRUE(recorded.ok());
  auto undisturbed = Auralizer::create(file, options.auralizer);
  ASSERT_TRUE(undisturbed.ok());
  std::vector<float> rendered;
  ASSERT_TRUE(
      render(**undisturbed, *options.walk, recorded->size(), [&](std::span<const float> block) {
        for (std::size_t i = 0; i < block.size(); i += 2)
          rendered.push_back(0.5f * (block[i] + block[i + 1]));
        return Result<void>();
      }).ok());
  ASSERT_EQ(recorded->size(), rendered.size());
  const auto difference = [&](double from_s) {
    double greatest = 0;
    for (auto i = static_cast<std::size_t>(from_s * kSampleRate_hz); i < rendered.size(); ++i)
      greatest = std::max(greatest, std::abs(static_cast<double>((*recorded)[i] - rendered[i])));
    return greatest;
  };
  double loudest = 0;
  for (const float sample : rendered)
    loudest = std::max(loudest, std::abs(static_cast<double>(sample)));
  // While it fades, its first samples may be coarse, because pages and visibilities are new.
  EXPECT_LT(difference(0.35), 0.2 * loudest) << "a gap, or sounds that began anew";
  EXPECT_LT(difference(kSeconds - 0.3), 1e-5 * loudest);
}

// Whatever it mixes to catch up, it is farther behind after that.
TEST(Player, ReplacesItsBakeOnAMachineThatMixesSlowerThanItPlays) {
  PlayerOptions options = standing();
  options.device = "none";
  options.seconds = 0;
  options.auralizer.voices = 50;
  testing::SlowThread slow;
  const auto file = testing::as_file(testing::baked_contents(50));
  auto player = Player::create(file, options);
  ASSERT_TRUE(player.ok() && (*player)->start().ok());
  AuralizerOptions next = options.auralizer;
  next.adapt = true;  // reads the clock
  next.sampler_clock = slow.sampler_clock();
  next.audio_clock = slow.audio_clock();
  slow.begin(**player);
  EXPECT_TRUE((*player)->replace(file, next).ok());
  slow.end();
  EXPECT_GT(slow.mixed_frames(), 0u);
  EXPECT_LE(slow.mixed_frames(), kSampleRate_hz / 2 + testing::SlowThread::kBlock_frames);
  // The new bake is heard, and can be replaced in its turn.
  EXPECT_TRUE(
      testing::comes_true([&] { return (*player)->statistics().auralizer.peak[0] > 0.001f; }));
  EXPECT_TRUE((*player)->replace(file, options.auralizer).ok());
  EXPECT_TRUE((*player)->stop().ok());
}

TEST(Player, FollowsAListenerWhoIsMoved) {
  PlayerOptions options = standing();
  options.device = "none";
  options.seconds = 0;
  auto player = Player::create(baked_room(), options);
  ASSERT_TRUE(player.ok());
  ASSERT_TRUE((*player)->start().ok());
  int moves = 0;
  EXPECT_TRUE(testing::comes_true([&] {
    (*player)->move({{1 + 0.08 * (moves % 50), 4, 1.6}, 0.1 * moves, 0});
    ++moves;
    const auto statistics = (*player)->statistics();
    return statistics.auralizer.keyframes > 10 && statistics.auralizer.peak[0] > 0;
  }));
  EXPECT_FALSE((*player)->finished());
  EXPECT_TRUE((*player)->stop().ok());
}

// Keyframes are made ahead for the requested blocks; devices use others, and change them.
TEST(Player, MakesKeyframesFarEnoughAheadForWhateverBlocksADeviceWants) {
  until_nothing_runs_dry([]() -> std::string {
    const auto world = std::make_shared<testing::FakeWorld>();
    world->block_frames = [](std::uint64_t block) { return block % 8 < 4 ? 4096u : 100u; };
    PlayerOptions options = standing();
    options.auralizer.voices = kFewVoices;
    options.driver = std::make_shared<testing::FakeDevices>(world);
    options.seconds = 0;
    options.block_frames = options.auralizer.block_frames = 128;
    auto player = Player::create(baked_room(), options);
    EXPECT_TRUE(player.ok() && (*player)->start().ok());
    if (!player.ok()) return "";
    const auto played = [&](double seconds) {
      const double start_s = (*player)->statistics().time_s;
      EXPECT_TRUE(
          testing::comes_true([&] { return (*player)->statistics().time_s > start_s + seconds; }));
      return (*player)->statistics();
    };
    const std::uint64_t first = played(0.3).auralizer.held_blocks;
    const PlayerStatistics later = played(1.5);
    EXPECT_TRUE((*player)->stop().ok());
    // 2: until the size is known.
    const bool runs_dry = first > 2 || later.auralizer.held_blocks > first;
    return runs_dry ? ran_dry(later) : "";
  });
}

std::vector<float> resampled(std::vector<float> samples, int rate_hz) {
  struct Rendered {
    std::vector<float> samples;
    std::size_t read = 0;
  } rendered{std::move(samples)};
  const auto next = [](void* from, std::span<float> interleaved) noexcept {
    auto& [all, read] = *static_cast<Rendered*>(from);
    for (float& sample : interleaved) sample = read < all.size() ? all[read++] : 0.0f;
  };
  std::vector<float> result(2 * static_cast<std::size_t>(kSeconds * rate_hz));
  const auto resampler = Resampler::create(2, kSampleRate_hz, rate_hz);
  EXPECT_TRUE(resampler.ok());
  if (resampler.ok()) (*resampler)->read(result, {next, &rendered});
  return result;
}

// The player resamples as with `play --rate`. A block of 256 frames at 8 kHz is one and a half
// keyframes.
TEST(Player, IsHeardAsTheOfflineRenderResampledFrom8To192KHz_NoAsan_NoTsan) {
  for (const int rate_hz : {8000, 32000, 192000}) {
    SCOPED_TRACE(rate_hz);
    std::vector<float> heard;
    until_nothing_runs_dry([&] {
      const auto world = std::make_shared<testing::FakeWorld>();
      world->rate_hz = rate_hz;
      PlayerOptions options = walking();
      options.driver = std::make_shared<testing::FakeDevices>(world);
      options.device_rate_hz = rate_hz;
      const PlayerStatistics played = play(options);
      EXPECT_EQ(played.output.rate_hz, rate_hz);
      EXPECT_TRUE(played.output.resamples);
      heard = world->taken();
      return held(played);
    });
    if (HasFatalFailure()) return;
    const std::vector<float> expected = resampled(offline(walking()), rate_hz);
    const auto first = std::ranges::find_if(heard, [](float sample) { return sample != 0; });
    const auto begin = static_cast<std::size_t>(first - heard.begin()) / 512 * 512;  // of a block
    ASSERT_GE(heard.size() - begin, expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i)
      ASSERT_NEAR(heard[begin + i], expected[i], 1e-6) << i;
  }
}

// Runs all threads while the listener walks.
TEST(Player, LeavesOutVoicesUnderABurdenAndHasAllOfThemBackAfterIt) {
  testing::Burden sampling, mixing;
  PlayerOptions options = standing();
  options.device = "none";
  options.seconds = 0;
  options.auralizer.adapt = true;
  options.auralizer.sampler_clock = sampling.clock();
  options.auralizer.audio_clock = mixing.clock();
  auto player = Player::create(baked_room(), options);
  ASSERT_TRUE(player.ok()) << player.error().message;
  ASSERT_TRUE((*player)->start().ok());
  double path_m = 0;
  const auto comes_to = [&](auto&& state) {
    return testing::comes_true([&] {
      path_m += 0.01;
      (*player)->move({{3 + std::sin(path_m), 5, 1.6}, path_m, 0});
      return state((*player)->statistics().auralizer);
    });
  };
  using Now = AuralizerStatistics;
  EXPECT_TRUE(comes_to([](const Now& now) { return now.voices > 150; }));
  const double block_s = 256.0 / kSampleRate_hz,
               keyframe_s = 1.0 * kKeyframeFrames / kSampleRate_hz;
  mixing.takes_s = 1.3 * block_s;
  EXPECT_TRUE(comes_to([](const Now& now) { return now.shed_voices > 0; }));
  EXPECT_TRUE(comes_to([](const Now& now) { return now.k < 150; }));
  sampling.takes_s = 3 * keyframe_s;
  EXPECT_TRUE(comes_to([](const Now& now) { return now.late_keyframes > 0; }));
  sampling.takes_s = mixing.takes_s = 0;
  EXPECT_TRUE(comes_to([](const Now& now) { return now.k == now.max_k && now.shed_voices == 0; }));
  EXPECT_TRUE((*player)->stop().ok());
  EXPECT_EQ((*player)->statistics().auralizer.bad_voices, 0u);
}

TEST(Player, SaysWhatToDoWhenADeviceDoesNotExist) {
  PlayerOptions options = standing();
  options.device = "no such device";
  const auto player = Player::create(baked_room(), options);
  ASSERT_FALSE(player.ok());
  EXPECT_NE(player.error().message.find("device"), std::string::npos);
}

}  // namespace
}  // namespace clamor
