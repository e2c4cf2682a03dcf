#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <random>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "common/platform/prefault_code.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/realtime/latest_value.h"
#include "runtime/realtime/prefault_stack.h"
#include "tests/baked_room.h"
#include "tests/realtime/forbidden.h"
#include "tests/sound_device.h"
#include "tests/walks.h"

namespace clamor {
namespace {

using testing::baked_room;
using testing::Forbidden;
using testing::SoundDevice;

// Calls through a volatile pointer, or the compiler would remove the call.
void* (*volatile allocate)(std::size_t) = std::malloc;

TEST(Forbidden, CatchesAnAllocation) {
  EXPECT_DEATH(
      {
        const Forbidden forbidden;
        allocate(1);
      },
      "forbidden on the audio thread: malloc");
}

TEST(Forbidden, CatchesALock) {
  std::mutex mutex;
  EXPECT_DEATH(
      {
        const Forbidden forbidden;
        mutex.lock();
      },
      "forbidden on the audio thread: pthread_mutex_lock");
}

TEST(Forbidden, CatchesASystemCall) {
  if (!Forbidden::watches_system_calls())
    GTEST_SKIP() << "this kernel cannot watch system calls: Linux 5.11 or later can";
  EXPECT_DEATH(
      {
        const Forbidden forbidden;
        ::getppid();
      },
      "forbidden on the audio thread: system call");
}

TEST(Forbidden, CountsPageFaults) {
  constexpr std::size_t kPages = 100, kPage_bytes = 4096;
  void* const fresh = ::mmap(nullptr, kPages * kPage_bytes, PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(fresh, MAP_FAILED);
  ::madvise(fresh, kPages * kPage_bytes, MADV_NOHUGEPAGE);
  const long before = testing::page_faults();
  for (std::size_t i = 0; i < kPages; ++i) static_cast<volatile char*>(fresh)[i * kPage_bytes] = 1;
  EXPECT_GE(testing::page_faults() - before, static_cast<long>(kPages));
  ::munmap(fresh, kPages * kPage_bytes);
}

// A path through the callback: output format and device rate.
struct Way {
  std::string name;
  OutputFormat shape;
  int rate_hz = kSampleRate_hz;
  bool is_field = false;
};

std::vector<Way> all_ways() {
  std::vector<Way> ways = {{"stereo", {}},
                           {"stereo for 44.1 kHz", {}, 44100},
                           {"binaural", {}},
                           {"5.1", *OutputFormat::from_options(false, "5.1", false)},
                           {"7.1.4", *OutputFormat::from_options(false, "7.1.4", false)},
                           {"ambisonics", *OutputFormat::from_options(false, "", true)}};
  ways[2].shape.kind = OutputFormat::Kind::kBinaural;
  ways[2].shape.head = *Hrtf::read("");
  ways.push_back({"a field", ways[2].shape, kSampleRate_hz, true});
  return ways;
}

std::unique_ptr<Auralizer> twelve_voices(const OutputFormat& shape, bool tracks_head = false,
                                         bool is_field = false) {
  AuralizerOptions options;
  options.tracks_head = tracks_head;
  options.mixing = is_field ? Mixing::kField : Mixing::kVoices;
  options.voices =
      is_field ? 600 : 12;  // of some 3000 sources: the sample changes as the listener moves
  options.output = shape;
  options.limit = true;
  options.gain = 4;  // and that it limits
  return *Auralizer::create(baked_room(60), options);
}

Listener running_about(double t) {
  return {{3 + 2.5 * std::sin(3 * t), 4 + 3.5 * std::cos(2 * t), 1.5}, 4 * t, 0.2};
}

// A million callbacks, with and without new keyframes: no allocation, lock or system call.
TEST(AudioThread, AsksTheSystemForNothingInAMillionCallbacks) {
  prefault_code();
  prefault_stack();  // the only page faults, at a thread's first callback
  const std::vector<Way> ways = all_ways();
  const int each = 1'000'000 / static_cast<int>(ways.size()) + 1;
  constexpr std::size_t kMaxBlock_frames = 8;
  std::minstd_rand random(1);
  std::uint64_t callbacks = 0;
  for (const Way& way : ways) {
    SCOPED_TRACE(way.name);
    SoundDevice run(twelve_voices(way.shape, false, way.is_field), way.rate_hz, kMaxBlock_frames);
    LatestValue<Listener> poses;
    const auto pose_at = [&](double t) {
      poses.publish(running_about(t));
      return poses.latest();
    };
    long faults = 0;
    for (int i = 0; i < each; ++i) {
      if (i % 4096 < 3072) run.make_keyframes(pose_at);  // the sampler stalls and returns
      const long before = testing::page_faults();
      run.call<Forbidden>(1 + random() % kMaxBlock_frames);
      faults += testing::page_faults() - before;
    }
    callbacks += run.callbacks();
    EXPECT_EQ(faults, 0);
    EXPECT_GT(run.energy(), 1);  // it has mixed sound
    EXPECT_GT(run.statistics().keyframes, 500u);
    EXPECT_GT(run.statistics().held_blocks, 100u);
    EXPECT_GT(run.statistics().limited.frames, 0u);
  }
  EXPECT_GE(callbacks, 1'000'000u);
}

// Rotations go to the audio thread directly, between keyframes and when none come.
TEST(AudioThread, AsksTheSystemForNothingWhileTheHeadTurns) {
  prefault_code();
  prefault_stack();
  constexpr std::size_t kMaxBlock_frames = 256;
  std::minstd_rand random(2);
  for (const Way& way : all_ways()) {
    SCOPED_TRACE(way.name);
    SoundDevice run(twelve_voices(way.shape, true), way.rate_hz, kMaxBlock_frames);
    long faults = 0;
    for (int i = 0; i < 4000; ++i) {
      const double time_s = run.time_s();
      run.auralizer().turn_head(running_about(time_s));
      if (i % 512 < 384) run.make_keyframes([&](double) { return running_about(time_s); });
      const long before = testing::page_faults();
      run.call<Forbidden>(1 + random() % kMaxBlock_frames);
      faults += testing::page_faults() - before;
    }
    EXPECT_EQ(faults, 0);
    EXPECT_GT(run.energy(), 1);
    EXPECT_GT(run.statistics().held_blocks, 100u);
  }
}

TEST(AudioThread, HasDenormalsOff) {
  // Halves the smallest normal number on the audio thread.
  static volatile float half = 0;
  half = std::numeric_limits<float>::min();
  half = half * 0.5f;
  ASSERT_GT(half, 0);
  const auto gate = std::make_shared<CallbackGate>(
      OutputCallback{[](void*, float*, std::uint32_t, bool) noexcept {
                       half = std::numeric_limits<float>::min();
                       half = half * 0.5f;
                     },
                     nullptr});
  DeviceFeed feed(gate, 1, 2);
  ASSERT_TRUE(feed.prepare(kSampleRate_hz, 64).ok());
  gate->give_to(1);
  std::array<float, 128> block{};
  feed.fill_at(DeviceFeed::Clock::now(), block.data(), 64, false);
  EXPECT_EQ(half, 0);
}

TEST(AudioThread, AllocatesNothingWhenTheSamplerHasStopped) {
  auto auralizer = Auralizer::create(baked_room(), {});
  ASSERT_TRUE(auralizer.ok());
  AudioCallback callback(**auralizer, nullptr, 0);
  testing::make_keyframes(**auralizer, Walk::standing({{3, 4, 1.5}, 0, 0}));
  std::array<float, 2 * 256> block{};
  for (int i = 0; i < 1000; ++i) {
    const Forbidden forbidden;
    callback.fill(block);
  }
  EXPECT_GT((*auralizer)->statistics().held_blocks, 900u);
}

// Each sample lies between those of the two auralizers, and nothing calls the system.
TEST(AudioCallback, FadesToAnotherAuralizerWithinATenthOfASecond) {
  const auto room = [](double gain) {
    AuralizerOptions options;
    options.gain = gain;
    options.wait_for_pages = true;
    auto made = Auralizer::create(baked_room(), options);
    EXPECT_TRUE(made.ok());
    return std::move(*made);
  };
  const auto standing = Walk::standing({{3, 4, 1.5}, 0, 0});
  constexpr std::size_t kFrames = 480, kFadeBlocks = 10;
  using Block = std::array<float, 2 * kFrames>;
  const auto old = room(1), old_alone = room(1), next = room(0.25), next_alone = room(0.25);
  AudioCallback callback(*old, nullptr, 0);
  Block block{}, from{}, to{};
  for (std::size_t i = 0; i < 30; ++i) {
    for (const auto* one : {&old, &old_alone, &next, &next_alone})
      testing::make_keyframes(**one, standing);
    if (i == 5) callback.fade_to(*next);
    {
      const Forbidden forbidden;
      callback.fill(block);
    }
    old_alone->mix(from);
    if (i >= 5) next_alone->mix(to);
    for (std::size_t s = 0; s < block.size(); ++s) {
      const double faded = (static_cast<double>(kFrames) * (static_cast<double>(i) - 5) +
                            static_cast<double>(s / 2) + 1) /
                           (kFadeBlocks * kFrames);
      const double share = std::clamp(faded, 0.0, 1.0);
      ASSERT_NEAR(block[s], from[s] + share * (to[s] - from[s]), 1e-6) << i << " " << s;
    }
    EXPECT_EQ(callback.has_faded(), i < 5 || i >= 5 + kFadeBlocks - 1) << i;
  }
}

TEST(AudioCallback, EndsInTwoBlocksOfSilence) {
  auto auralizer = Auralizer::create(baked_room(), {});
  ASSERT_TRUE(auralizer.ok());
  AudioCallback callback(**auralizer, nullptr, 1000);
  testing::make_keyframes(**auralizer, Walk::standing({{3, 4, 1.5}, 0, 0}));
  std::array<float, 2 * 256> block{};
  for (int i = 0; i < 4; ++i) callback.fill(block);  // 1024 frames
  for (std::size_t i = 2 * (1000 - 768); i < block.size(); ++i) EXPECT_EQ(block[i], 0);
  EXPECT_FALSE(callback.counters().finished);
  callback.fill(block);
  callback.fill(block);
  EXPECT_TRUE(callback.counters().finished);
  EXPECT_EQ(callback.counters().frames, 1000u);
}

}  // namespace
}  // namespace clamor
