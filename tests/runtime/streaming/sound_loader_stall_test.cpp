// sound_loader_stall_test.cpp: the output while the disk stalls, or the sampler.
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/streaming/sound_loader.h"
#include "tests/runtime/streaming/played_tones.h"

namespace clamor {
namespace {

using testing::bend;
using testing::decoder;
using testing::kMaxBend;
using testing::kPlain;
using testing::kSecond_frames;
using testing::Playing;
using testing::sample_at;
using testing::tone_voice;

// A decoder that can be made to stall.
struct Stall {
  std::mutex mutex;
  std::condition_variable changed;
  bool stalled = false;
  int waiting = 0;

  void set(bool now) {
    const std::lock_guard lock(mutex);
    stalled = now;
    changed.notify_all();
  }
  // Returns whether the loader is stalled; everything decoded before is loaded.
  bool holds() {
    const std::lock_guard lock(mutex);
    return waiting > 0;
  }
  SignalBlockCache::Decode around(SignalBlockCache::Decode decode) {
    return [this, decode](std::size_t signal, std::size_t block) {
      std::unique_lock lock(mutex);
      ++waiting;
      changed.wait(lock, [this] { return !stalled; });
      --waiting;
      lock.unlock();
      return decode(signal, block);
    };
  }
};

TEST(SoundLoader, FadesVoicesToSilenceDuringAStallAndBackWithoutAClick) {
  const std::vector<SignalDescription> shapes = {{600 * kSecond_frames, true}};
  Stall stall;
  SoundLoader loader(shapes, {}, kPlain, stall.around(decoder(shapes)), {20'000'000, true}, 2);
  const std::vector<Voice> voices = {tone_voice(0, 0, -5)};
  Playing streamed(loader.signals(), voices, kPlain, &loader);
  std::vector<float> heard;
  const auto play = [&](int segments, bool wait) {
    for (int k = 0; k < segments; ++k) {
      const auto part = streamed.segment(true, wait);
      heard.insert(heard.end(), part.begin(), part.end());
    }
  };
  play(20, true);
  stall.set(true);
  while (!stall.holds()) {
    play(1, false);
    loader.wait(0.005);
  }
  play(600, false);  // 12 s, some of which are decoded
  const std::uint64_t late = streamed.mixer().late_voices();
  EXPECT_GT(late, 100u);
  stall.set(false);
  play(1, true);
  play(100, true);
  EXPECT_LE(streamed.mixer().late_voices(), late + 1);
  // Each sample is exactly the sound, exactly silence, or on a ramp between them.
  EXPECT_LT(bend(heard), kMaxBend);
  std::size_t silent = 0, sounding = 0, between = 0;
  for (std::size_t i = 0; i < heard.size(); ++i) {
    const float expected = sample_at(0, i + 5 * kSecond_frames);
    if (heard[i] == 0)
      ++silent;
    else if (std::abs(heard[i] - expected) < 1e-5f)
      ++sounding;
    else
      ++between;
    ASSERT_LE(std::abs(heard[i]), std::abs(expected) + 1e-5f) << i;
  }
  EXPECT_GT(silent, 100u * kKeyframeFrames);
  EXPECT_GT(sounding, 200u * kKeyframeFrames);
  EXPECT_LE(between, 2u * kKeyframeFrames + 10);
}

TEST(SoundLoader, FollowsTheClockWhileTheSamplerStalls) {
  const std::vector<SignalDescription> shapes = {{30 * kSecond_frames, true}};
  SoundLoader loader(shapes, {}, kPlain, decoder(shapes), {3'000'000, true}, 2);
  Playing streamed(loader.signals(), {tone_voice(0, 0, 3)}, kPlain, &loader);
  for (std::uint64_t k = 0; k < 400; ++k) {
    const auto heard = streamed.segment(k < 5);
    for (std::uint64_t i = 0; i < heard.size(); ++i) {
      const std::uint64_t frame = 27 * kSecond_frames + k * kKeyframeFrames + i;
      ASSERT_NEAR(heard[i], sample_at(0, frame % shapes[0].frames), 1e-5) << k << " " << i;
    }
  }
  EXPECT_EQ(streamed.mixer().late_voices(), 0u);
  EXPECT_GE(loader.statistics().loaded, 3u);
}

TEST(SoundLoader, EndsInSilenceWithoutAClickWhenDiskAndSamplerStall) {
  const std::vector<SignalDescription> shapes = {{40 * kSecond_frames, true},
                                                 {kSecond_frames, true}};
  Stall stall;
  SoundLoader loader(shapes, {}, kPlain, stall.around(decoder(shapes)), {20'000'000, true}, 2);
  const std::vector<Voice> voices = {tone_voice(0, 0, 0), tone_voice(1, 1, 0, 0.25f)};
  Playing streamed(loader.signals(), voices, kPlain, &loader);
  std::vector<float> heard;
  const auto play = [&](int segments, bool keyframe, bool wait) {
    for (int k = 0; k < segments; ++k) {
      const auto part = streamed.segment(keyframe, wait);
      heard.insert(heard.end(), part.begin(), part.end());
    }
  };
  play(20, true, true);
  stall.set(true);
  play(600, false, false);
  // The short sound continues.
  const float* const last = &heard[heard.size() - kKeyframeFrames];
  for (int i = 0; i < kKeyframeFrames; ++i) {
    const std::uint64_t frame = (heard.size() - kKeyframeFrames + static_cast<std::size_t>(i));
    ASSERT_NEAR(last[i], 0.25f * sample_at(1, frame % kSecond_frames), 1e-5) << i;
  }
  stall.set(false);
  play(1, true, true);
  play(20, true, true);
  EXPECT_LT(bend(heard), 2 * kMaxBend);
  const std::uint64_t frame = heard.size() - 1;
  EXPECT_NEAR(heard.back(), sample_at(0, frame) + 0.25f * sample_at(1, frame % kSecond_frames),
              1e-5);
}

}  // namespace
}  // namespace clamor
