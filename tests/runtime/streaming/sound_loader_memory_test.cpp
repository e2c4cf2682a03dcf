// sound_loader_memory_test.cpp: which sounds are in memory: a loader without threads, whose clock
// and voices the tests move.
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/propagation/loudness.h"
#include "runtime/streaming/sound_loader.h"
#include "tests/runtime/streaming/played_tones.h"

namespace clamor {
namespace {

using testing::decoder;
using testing::kPlain;
using testing::kSecond_frames;
using testing::tone_voice;

constexpr std::size_t kKeyframesAhead = 2;

// Loops of two seconds that all have the same level, and memory for some of them.
class LoopsInMemory {
 public:
  LoopsInMemory(std::size_t loops, double fit)
      : shapes_(loops, {2 * kSecond_frames, true, same_in_all_bands(0.01f)}),
        loader_(shapes_, {}, kPlain, decoder(shapes_),
                {static_cast<std::uint64_t>(fit * static_cast<double>(loop_bytes())), true},
                kKeyframesAhead, 0) {}

  SoundLoader& loader() { return loader_; }

  // A keyframe with a voice for each of these loops, by its amplitude, and sources that want
  // others, by their power relative to a voice of amplitude 1. Loads what it can.
  using ByLoop = std::vector<std::pair<std::uint32_t, float>>;
  void keyframe(const ByLoop& voices, const ByLoop& sources) {
    std::vector<Voice> playing;
    std::vector<WantedSound> wanted;
    for (const auto& [loop, amplitude] : voices)
      playing.push_back(tone_voice(loop, loop, 0, amplitude));
    float unit = 0;  // power of a voice of amplitude 1
    for (const float loudness : loudness_weights()) unit += 0.01f * loudness;
    for (const auto& [loop, power] : sources) wanted.push_back({loop, 0, power * unit});
    loader_.mark_quiescent(clock_frames_);
    loader_.play(playing, wanted);
    while (loader_.load_next()) {
    }
    clock_frames_ += kKeyframeFrames;
  }

  // Which sounds a source may begin to play, and which ones voices may read.
  std::vector<std::uint32_t> ready() const {
    std::vector<std::uint32_t> found;
    for (std::uint32_t s = 0; s < shapes_.size(); ++s)
      if (loader_.is_ready(s, 0)) found.push_back(s);
    return found;
  }
  std::vector<std::uint32_t> readable() const {
    std::vector<std::uint32_t> found;
    for (std::uint32_t s = 0; s < shapes_.size(); ++s)
      if (loader_.signals()[s].is_resident(0, kSampleRate_hz)) found.push_back(s);
    return found;
  }

 private:
  std::uint64_t loop_bytes() const { return SoundLoader::bytes_of({shapes_[0]}, kPlain); }

  const std::vector<SignalDescription> shapes_;
  SoundLoader loader_;
  std::int64_t clock_frames_ = 0;
};

using Loops = std::vector<std::uint32_t>;

TEST(SoundLoader, LoadsTheLoudestSoundsFirst) {
  LoopsInMemory loops(6, 6);
  SoundLoader& loader = loops.loader();
  const std::vector<WantedSound> wanted = {{0, 0, 3}, {1, 0, 1}, {2, 0, 2.5f},
                                           {3, 0, 2}, {4, 0, 5}, {2, 0, 3.5f}};
  loader.play({}, wanted);
  std::vector<Loops> ready;
  while (loader.load_next()) ready.push_back(loops.ready());
  // The two sources of loop 2 are the loudest together. Nobody wants loop 5, but there is room.
  EXPECT_EQ(ready, (std::vector<Loops>{
                       {2}, {2, 4}, {0, 2, 4}, {0, 2, 3, 4}, {0, 1, 2, 3, 4}, {0, 1, 2, 3, 4, 5}}));
  EXPECT_TRUE(loader.all_ready());
  EXPECT_EQ(loader.statistics().over_budget, 0u);
}

TEST(SoundLoader, LetsVoicesOfAQuietSoundFadeOutBeforeALoudOneTakesItsMemory) {
  LoopsInMemory loops(3, 2.5);
  loops.keyframe({}, {{0, 9}, {1, 1}});
  EXPECT_EQ(loops.ready(), (Loops{0, 1}));
  loops.keyframe({{0, 3}, {1, 1}}, {{2, 5}});
  EXPECT_EQ(loops.ready(), Loops{0});
  EXPECT_EQ(loops.readable(), (Loops{0, 1}));
  // The voice of loop 1 fades out in five keyframes, and its source waits. The mixer may still read
  // for as long as keyframes wait for it.
  for (int k = 0; k < 5; ++k) loops.keyframe({{0, 3}, {1, 0.2f * (4 - k)}}, {{1, 1}, {2, 5}});
  for (std::size_t k = 0; k < kKeyframesAhead + 2; ++k) loops.keyframe({{0, 3}}, {{1, 1}, {2, 5}});
  EXPECT_EQ(loops.readable(), (Loops{0, 1}));
  loops.keyframe({{0, 3}}, {{1, 1}, {2, 5}});
  loops.keyframe({{0, 3}}, {{1, 1}, {2, 5}});  // the audio thread has finished with loop 1
  EXPECT_EQ(loops.readable(), (Loops{0, 2}));
  EXPECT_EQ(loops.ready(), (Loops{0, 2}));
  EXPECT_EQ(loops.loader().statistics().over_budget, 1u);
  EXPECT_GT(loops.loader().statistics().handed_over, 0u);
}

TEST(SoundLoader, TakesTheMemoryOfAQuietSoundAfterHalfASecondThoughItsVoicePlaysOn) {
  LoopsInMemory loops(3, 2.5);
  loops.keyframe({}, {{0, 9}, {1, 1}});
  for (int k = 0; k < 25; ++k) loops.keyframe({{0, 3}, {1, 1}}, {{2, 5}});
  EXPECT_EQ(loops.readable(), (Loops{0, 1}));
  for (int k = 0; k < 3; ++k) loops.keyframe({{0, 3}, {1, 1}}, {{2, 5}});
  EXPECT_EQ(loops.readable(), (Loops{0, 2}));
}

TEST(SoundLoader, ReplacesNoSoundByOneThatIsAboutAsLoud) {
  LoopsInMemory loops(3, 2.5);
  loops.keyframe({}, {{0, 1}, {1, 1}});
  for (int k = 0; k < 100; ++k) loops.keyframe({{0, 1}, {1, 1}}, {{2, k % 2 == 0 ? 0.6f : 1.8f}});
  EXPECT_EQ(loops.ready(), (Loops{0, 1}));
  EXPECT_EQ(loops.loader().statistics().loaded, 2u);
}

}  // namespace
}  // namespace clamor
