#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <random>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "runtime/audio_callback.h"
#include "runtime/latest_value.h"
#include "runtime/output_feed.h"
#include "runtime/render.h"
#include "runtime/resident_memory.h"
#include "runtime/touch_stack.h"
#include "tests/realtime/forbidden.h"
#include "tests/rooms_runtime.h"

namespace clamor {
namespace {

using testing::baked_room;
using testing::Forbidden;

// Through a pointer that the compiler cannot see through, or it would leave the call out.
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

// One way through the callback: what the channels are, and the device's rate.
struct Way {
  std::string name;
  OutputShape shape;
  int rate_hz = kSampleRate_hz;
};

std::vector<Way> all_ways() {
  std::vector<Way> ways = {{"stereo", {}},
                           {"stereo for 44.1 kHz", {}, 44100},
                           {"binaural", {}},
                           {"5.1", *OutputShape::asked_for(false, "5.1", false)},
                           {"7.1.4", *OutputShape::asked_for(false, "7.1.4", false)},
                           {"ambisonics", *OutputShape::asked_for(false, "", true)}};
  ways[2].shape.kind = OutputShape::Kind::kBinaural;
  ways[2].shape.head = *Head::read("");
  return ways;
}

// All that lies between a device and the sources, with a listener who runs about.
class PathOfSound {
 public:
  explicit PathOfSound(const Way& way)
      : channels_(static_cast<std::size_t>(way.shape.channels())),
        auralizer_(*Auralizer::create(baked_room(60), options(way.shape))),
        callback_(*auralizer_, &recorded_, 0, &metered_),
        gate_(std::make_shared<CallbackGate>(OutputCallback{&PathOfSound::fill, this})),
        feed_(gate_, 1, static_cast<int>(channels_)),
        rate_hz_(way.rate_hz) {
    EXPECT_TRUE(feed_.prepare(way.rate_hz, kMost_frames).ok());
    gate_->give_to(1);
  }

  void make_keyframes() {
    while (auralizer_->wants_keyframe()) {
      poses_.publish(pose_at(auralizer_->next_keyframe_time_s()));
      auralizer_->make_keyframe(poses_.latest());
    }
  }

  // One callback of any size, as a device would make it in time.
  void call() {
    const auto frames = static_cast<std::uint32_t>(1 + random_() % kMost_frames);
    const std::span<float> part(block_.data(), frames * channels_);
    time_s_ += static_cast<double>(frames) / rate_hz_;
    const auto now = start_ + std::chrono::duration_cast<OutputFeed::Clock::duration>(
                                  std::chrono::duration<double>(time_s_));
    const long before = testing::page_faults();
    {
      const Forbidden forbidden;
      feed_.fill_at(now, part.data(), frames, false);
    }
    faults += testing::page_faults() - before;
    for (const float sample : part) energy += static_cast<double>(sample) * sample;
    while (recorded_.read(drained_) > 0 || metered_.read(drained_) > 0) {
    }
  }

  AuralizerStatistics statistics() { return auralizer_->statistics(); }
  std::uint64_t callbacks() const { return gate_->counters().callbacks; }

  double energy = 0;
  long faults = 0;

 private:
  static constexpr int kMost_frames = 8;

  static AuralizerOptions options(const OutputShape& shape) {
    AuralizerOptions options;
    options.voices = 12;  // of some 3000 sources: the sample changes as the listener moves
    options.output = shape;
    options.limit = true;
    options.gain = 4;  // and that it works
    return options;
  }
  static Pose pose_at(double t) {
    return {{3 + 2.5 * std::sin(3 * t), 4 + 3.5 * std::cos(2 * t), 1.5}, 4 * t, 0.2};
  }
  static void fill(void* self, float* output, std::uint32_t frames, bool) noexcept {
    auto& run = *static_cast<PathOfSound*>(self);
    run.callback_.fill({output, frames * run.channels_});
  }

  const std::size_t channels_;
  const std::unique_ptr<Auralizer> auralizer_;
  SampleRing recorded_{1 << 14}, metered_{1 << 14};
  AudioCallback callback_;
  const std::shared_ptr<CallbackGate> gate_;
  OutputFeed feed_;
  const double rate_hz_;
  double time_s_ = 0;
  const OutputFeed::Clock::time_point start_ = OutputFeed::Clock::now();
  LatestValue<Pose> poses_;
  std::minstd_rand random_{1};
  std::array<float, 16 * kMost_frames> block_{};
  std::array<float, 4096> drained_{};
};

// A million callbacks, with keyframes that arrive, and do not; no allocation, lock or system call.
TEST(AudioThread, AsksTheSystemForNothingInAMillionCallbacks) {
  touch_all_code();
  touch_stack();  // the only faults that there are, at a thread's first callback
  const std::vector<Way> ways = all_ways();
  const int each = 1'000'000 / static_cast<int>(ways.size()) + 1;
  std::uint64_t callbacks = 0;
  for (const Way& way : ways) {
    SCOPED_TRACE(way.name);
    PathOfSound run(way);
    for (int i = 0; i < each; ++i) {
      if (i % 4096 < 3072) run.make_keyframes();  // the sampler stalls, and comes back
      run.call();
    }
    callbacks += run.callbacks();
    EXPECT_EQ(run.faults, 0);
    EXPECT_GT(run.energy, 1);  // it did mix
    EXPECT_GT(run.statistics().keyframes, 500u);
    EXPECT_GT(run.statistics().held_blocks, 100u);
    EXPECT_GT(run.statistics().limited.frames, 0u);
  }
  EXPECT_GE(callbacks, 1'000'000u);
}

TEST(AudioThread, HasDenormalsOff) {
  // Half of the smallest number that is none, for whoever is asked on the audio thread.
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
  OutputFeed feed(gate, 1, 2);
  ASSERT_TRUE(feed.prepare(kSampleRate_hz, 64).ok());
  gate->give_to(1);
  std::array<float, 128> block{};
  feed.fill_at(OutputFeed::Clock::now(), block.data(), 64, false);
  EXPECT_EQ(half, 0);
}

TEST(AudioThread, AllocatesNothingWhenTheSamplerHasStopped) {
  auto auralizer = Auralizer::create(baked_room(), {});
  ASSERT_TRUE(auralizer.ok());
  AudioCallback callback(**auralizer, nullptr, 0);
  make_keyframes(**auralizer, Walk::standing({{3, 4, 1.5}, 0, 0}));
  std::array<float, 2 * 256> block{};
  for (int i = 0; i < 1000; ++i) {
    const Forbidden forbidden;
    callback.fill(block);
  }
  EXPECT_GT((*auralizer)->statistics().held_blocks, 900u);
}

TEST(AudioCallback, EndsInTwoBlocksOfSilence) {
  auto auralizer = Auralizer::create(baked_room(), {});
  ASSERT_TRUE(auralizer.ok());
  AudioCallback callback(**auralizer, nullptr, 1000);
  make_keyframes(**auralizer, Walk::standing({{3, 4, 1.5}, 0, 0}));
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
