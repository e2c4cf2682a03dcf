#include <array>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <random>

#include <gtest/gtest.h>

#include "runtime/audio_callback.h"
#include "runtime/render.h"
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

TEST(AudioThread, AllocatesNothingAndLocksNothingWhileAListenerRunsAbout) {
  AuralizerOptions options;
  options.voices = 40;  // of some 3000 sources: the sample changes as the listener moves
  auto auralizer = Auralizer::create(baked_room(), options);
  ASSERT_TRUE(auralizer.ok());
  SampleRing ring(1 << 16);
  AudioCallback callback(**auralizer, &ring, 0);

  std::array<float, 2 * 512> block{};
  std::array<float, 4096> drained;
  std::minstd_rand random(1);
  double energy = 0;
  for (int i = 0; i < 20000; ++i) {
    while ((*auralizer)->wants_keyframe()) {
      const double t = (*auralizer)->next_keyframe_time_s();
      (*auralizer)
          ->make_keyframe({{3 + 2.5 * std::sin(3 * t), 4 + 3.5 * std::cos(2 * t), 1.5}, 4 * t, 0});
    }
    const std::span<float> part(block.data(), 2 * (1 + random() % 512));
    {
      const Forbidden forbidden;
      callback.fill(part);
    }
    for (const float sample : part) energy += static_cast<double>(sample) * sample;
    while (ring.read(drained) > 0) {
    }
  }
  EXPECT_GT(energy, 1);  // it did mix
  EXPECT_EQ((*auralizer)->statistics().held_blocks, 0u);
}

// Binaural, loudspeakers and ambisonics have their own ways through the mixer.
TEST(AudioThread, AllocatesNothingWhateverTheChannelsAre) {
  std::vector<OutputShape> shapes(1);
  shapes[0].kind = OutputShape::Kind::kBinaural;
  shapes[0].head = *Head::read("");
  shapes.push_back(*OutputShape::asked_for(false, "5.1", false));
  shapes.push_back(*OutputShape::asked_for(false, "7.1.4", false));
  shapes.push_back(*OutputShape::asked_for(false, "", true));
  for (const OutputShape& shape : shapes) {
    AuralizerOptions options;
    options.voices = 40;
    options.output = shape;
    auto auralizer = Auralizer::create(baked_room(), options);
    ASSERT_TRUE(auralizer.ok());
    AudioCallback callback(**auralizer, nullptr, 0);
    const auto channels = static_cast<std::size_t>(shape.channels());
    std::vector<float> block(channels * 256);
    double energy = 0;
    for (int i = 0; i < 1000; ++i) {
      while ((*auralizer)->wants_keyframe()) {
        const double t = (*auralizer)->next_keyframe_time_s();
        (*auralizer)
            ->make_keyframe(
                {{3 + 2.5 * std::sin(3 * t), 4 + 3.5 * std::cos(2 * t), 1.5}, 4 * t, 0.2});
      }
      {
        const Forbidden forbidden;
        callback.fill(block);
      }
      for (const float sample : block) energy += static_cast<double>(sample) * sample;
    }
    EXPECT_GT(energy, 0.1);
  }
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
