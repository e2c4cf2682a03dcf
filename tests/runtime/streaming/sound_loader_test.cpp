#include "runtime/streaming/sound_loader.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <random>
#include <thread>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include "common/random.h"
#include "runtime/mixing/mixer.h"
#include "runtime/realtime/prefault_stack.h"
#include "runtime/voices/octave_filter_bank.h"
#include "tests/runtime/streaming/played_tones.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

using testing::bend;
using testing::decoder;
using testing::kMaxBend;
using testing::kPlain;
using testing::kSecond_frames;
using testing::Playing;
using testing::sample_at;
using testing::sound;
using testing::tone_voice;

std::uint64_t resident_bytes(std::span<const std::byte> memory) {
  const std::size_t page = ReservedMemory::page_bytes();
  std::vector<unsigned char> present(memory.size() / page);
  EXPECT_EQ(::mincore(const_cast<std::byte*>(memory.data()), memory.size(), present.data()), 0);
  return page * static_cast<std::uint64_t>(
                    std::count_if(present.begin(), present.end(), [](auto p) { return p & 1; }));
}

TEST(PreparedSignal, InPiecesEqualsThatOfTheWholeSound_NoTsan) {
  for (const bool loop : {true, false}) {
    if (testing::kSanitized && loop) continue;  // slow
    const bool phase_undone = loop;
    const SignalDescription shape{21 * kSecond_frames + 1234, loop};
    Signal signal = sound(0, shape);
    for (std::uint32_t i = 0; i < signal.samples.size(); ++i)
      signal.samples[i] += static_cast<float>(unit(philox(3, {i, 0, 0, 0})[0]) - 0.5);
    // The high layer is compared directly, the low one through its spline.
    MixMode mode{.interpolation = Interpolation::kLinear};
    mode.head = !phase_undone;
    const PreparedSignal pieces(signal, mode);
    ASSERT_GT(pieces.pieces(), 5u);
    const std::vector<double> samples(signal.samples.begin(), signal.samples.end());
    const auto whole = OctaveFilterBank::part(samples, loop, phase_undone);
    VoicePath path;
    pieces.place(0, path);
    const std::int64_t front = loop ? 0 : kBankTailFrames;
    double error = 0;
    for (std::int64_t n = -front; n < static_cast<std::int64_t>(whole.high.size()) - front; ++n)
      error =
          std::max(error, std::abs(path.high[n] - whole.high[static_cast<std::size_t>(n + front)]));
    for (std::int64_t k = 1; k + 1 < static_cast<std::int64_t>(shape.frames) / kLowRate; ++k) {
      const double low = (path.low[k - 1] + 4.0 * path.low[k] + path.low[k + 1]) / 3;
      error = std::max(error,
                       std::abs(low - whole.low[static_cast<std::size_t>(k + front / kLowRate)]));
    }
    // The filters' memory is cut at -150 dB, and floats end 140 dB below these samples.
    EXPECT_LT(error, 2e-7) << loop << phase_undone;
    EXPECT_GT(*std::max_element(whole.high.begin(), whole.high.end()), 0.3);
  }
}

TEST(SoundLoader, PlaysLikeDecodedSoundsAcrossPiecesLoopsAndEnds_NoTsan) {
  const std::vector<SignalDescription> shapes = {{25 * kSecond_frames + 17, true},
                                                 {22 * kSecond_frames + 5, false},
                                                 {kSecond_frames / 2, true}};
  std::vector<Signal> sounds;
  for (std::size_t s = 0; s < shapes.size(); ++s) sounds.push_back(sound(s, shapes[s]));
  // The voices play the beginning, the middle and the end of both long sounds within the first 4
  // seconds.
  const std::vector<Voice> voices = {tone_voice(0, 0, 1.5), tone_voice(1, 0, 14),
                                     tone_voice(2, 1, 1),   tone_voice(3, 1, -20.5),
                                     tone_voice(4, 1, -10), tone_voice(5, 2, 3)};
  for (const bool plain : {false, true}) {
    if (testing::kSanitized && !plain) continue;  // slow
    const MixMode mode = plain ? kPlain : MixMode{};
    const auto decoded = prepare_signals(sounds, mode);
    SoundLoader loader(shapes, {}, mode, decoder(shapes), {12'000'000, true}, 2);
    Playing all(decoded, voices, mode), streamed(loader.signals(), voices, mode, &loader);
    double energy = 0;
    for (int k = 0; k < 200; ++k) {
      const auto expected = all.segment();
      ASSERT_EQ(expected, streamed.segment()) << k;
      for (const float x : expected) energy += static_cast<double>(x) * x;
    }
    EXPECT_GT(energy, 1000);
    EXPECT_EQ(streamed.mixer().late_voices(), 0u);
    EXPECT_EQ(loader.statistics().failed, 0u);
  }
}

TEST(SoundLoader, KeepsItsBudgetForHalfAnHourAndCountsResidentMemory) {
  const std::vector<SignalDescription> shapes(3, {1800 * kSecond_frames, true});
  constexpr std::uint64_t kBudget = 6'000'000;
  SoundLoader loader(shapes, {}, kPlain, decoder(shapes), {kBudget, true}, 2, 2);
  EXPECT_GT(loader.memory().size(), 1'000'000'000u);
  EXPECT_EQ(resident_bytes(loader.memory()), 0u);
  const std::vector<Voice> voices = {tone_voice(0, 0, 0), tone_voice(1, 1, -600),
                                     tone_voice(2, 2, -1790)};
  Playing streamed(loader.signals(), voices, kPlain, &loader);
  const int seconds = testing::kSanitized ? 10 : 25;
  for (int k = 0; k < 50 * seconds; ++k) {
    streamed.segment();
    if (k % 100 == 0) {
      EXPECT_LE(resident_bytes(loader.memory()), kBudget) << k;
    }
  }
  EXPECT_EQ(streamed.mixer().late_voices(), 0u);
  // Loading comes to rest because the clock stands still; until then the two counts may differ.
  SoundStatistics statistics = loader.statistics();
  std::uint64_t resident = resident_bytes(loader.memory());
  for (int i = 0; i < 1000 && resident != statistics.bytes; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    statistics = loader.statistics();
    resident = resident_bytes(loader.memory());
  }
  EXPECT_LE(statistics.max_bytes, kBudget);
  EXPECT_GT(statistics.dropped, 3u);
  EXPECT_EQ(statistics.over_budget, 0u);
  EXPECT_EQ(resident, statistics.bytes);
  EXPECT_GT(statistics.bytes, kBudget / 4);
}

TEST(SoundLoader, SilencesOnlyVoicesThatNeedADamagedBlock_NoAsan_NoTsan) {
  const std::vector<SignalDescription> shapes = {{60 * kSecond_frames, true},
                                                 {60 * kSecond_frames, true}};
  const auto decode = decoder(shapes);
  const auto damaged = [&](std::size_t signal, std::size_t block) -> Result<std::vector<float>> {
    if (signal == 0 && block == 2) return Error("block 3 of 6 fails its checksum");
    return decode(signal, block);
  };
  SoundLoader loader(shapes, {}, kPlain, damaged, {20'000'000, true}, 2);
  SoundLoader sane(shapes, {}, kPlain, decode, {20'000'000, true}, 2);
  const std::vector<Voice> voices = {tone_voice(0, 0, -14), tone_voice(1, 1, 0)};
  const std::vector<Voice> other = {tone_voice(0, 1, 0)};
  Playing all(sane.signals(), voices, kPlain, &sane),
      streamed(loader.signals(), voices, kPlain, &loader),
      alone(sane.signals(), other, kPlain, &sane);
  std::vector<float> heard;
  int whole = 0, without = 0;
  for (int k = 0; k < 1000; ++k) {  // seconds 14 to 34, of which 20 to 30 are lost
    const auto part = streamed.segment(), expected = all.segment(), left = alone.segment();
    heard.insert(heard.end(), part.begin(), part.end());
    whole += part == expected;
    without += part == left;
    ASSERT_TRUE(k > 100 || part == expected) << k;
    ASSERT_TRUE(k < 320 || k > 780 || part == left) << k;
  }
  // On each side at most a piece of 2.7 s and the memory of the filters is lost as well.
  EXPECT_GE(whole, 1000 - 500 - 2 * 150);
  EXPECT_GE(without, 500 - 5);
  EXPECT_GE(whole + without, 1000 - 2);
  EXPECT_LT(bend(heard), 2 * kMaxBend);
  const SoundStatistics statistics = loader.statistics();
  EXPECT_GE(statistics.failed, 4u);
  EXPECT_EQ(statistics.failure, "block 3 of 6 fails its checksum");
}

TEST(SoundLoader, PlaysTheLoudestVoicesWithTooLittleMemoryAndReportsIt) {
  const std::vector<SignalDescription> shapes(
      8, {600 * kSecond_frames, true, same_in_all_bands(0.01f)});
  SoundLoader loader(shapes, {}, kPlain, decoder(shapes), {3'000'000, true}, 2);
  std::vector<Voice> voices;
  for (std::uint32_t s = 0; s < 8; ++s)
    voices.push_back(tone_voice(s, s, -100 * static_cast<double>(s) - 1, s == 5 ? 1.0f : 0.01f));
  Playing streamed(loader.signals(), voices, kPlain, &loader);
  double energy = 0, of_loudest = 0;
  for (int k = 0; k < 100; ++k)
    for (const float x : streamed.segment()) energy += static_cast<double>(x) * x;
  for (std::uint64_t i = 0; i < 100 * kKeyframeFrames; ++i)
    of_loudest += std::pow(sample_at(5, i + 501 * kSecond_frames), 2);
  EXPECT_GT(loader.statistics().over_budget, 0u);
  EXPECT_LE(loader.statistics().max_bytes, 3'000'000u);
  // The others are 40 dB lower.
  EXPECT_NEAR(energy / of_loudest, 1, 0.05);
  EXPECT_LT(streamed.mixer().late_voices(), 8u * 100);
}

// A player that opens a crowd's file loads what emitters play, and then its first keyframe asks for
// other pieces. Nothing has been mixed yet, and nothing will be before they are there.
TEST(SoundLoader, ReplacesPiecesBeforeTheFirstSegmentIsMixed) {
  const std::vector<SignalDescription> shapes(8, {600 * kSecond_frames, true});
  std::vector<Emitter> emitters(8);
  for (std::uint32_t e = 0; e < 8; ++e) emitters[e].signal = e;
  SoundLoader loader(shapes, emitters, kPlain, decoder(shapes), {5'000'000, true}, 2, 0);
  while (loader.load_next()) {
  }
  const std::uint64_t loaded = loader.statistics().loaded;
  ASSERT_GT(loaded, 1u);
  const std::vector<Voice> voices = {tone_voice(0, 0, -300), tone_voice(1, 1, -300)};
  loader.play(voices);
  EXPECT_FALSE(loader.wait(0));
  EXPECT_EQ(loader.statistics().loaded, loaded + 1) << "without time, one";
  EXPECT_TRUE(loader.wait(3600));
  EXPECT_GT(loader.statistics().loaded, loaded + 1);
  EXPECT_EQ(loader.statistics().over_budget, 0u);
}

long page_faults() {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

// Voices that jump at random within long sounds of constant value.
class JumpingVoices {
 public:
  static constexpr std::size_t kCount = 6;

  JumpingVoices() {
    for (std::uint32_t s = 0; s < kCount; ++s)
      jump(keyframe_.voices.emplace_back(tone_voice(s, 0, 0)));
  }

  const Keyframe& next() {
    for (Voice& one : keyframe_.voices) {
      one.starts = false;
      int& age = segments_[one.slot];
      ++age;
      for (Bands& ear : one.gain) ear.fill(1.0f / kCount);
      if (age > 60 && random_() % 40 == 0) age = -1;
      if (age == -1)
        for (Bands& ear : one.gain) ear.fill(0);
      if (age == 0) jump(one);
    }
    return keyframe_;
  }
  const Keyframe& keyframe() const { return keyframe_; }

 private:
  void jump(Voice& one) {
    const auto slot = one.slot;
    one = tone_voice(slot, random_() % 4, -static_cast<double>(random_() % 900), 1.0f / kCount);
    one.starts = true;
    one.start_delay_frames = one.delay_frames;
  }

  std::mt19937 random_{5};
  Keyframe keyframe_;
  std::array<int, kCount> segments_{};  // since the last jump, or the fade-in after it
};

// Voices jump within sounds of constant value while thousands of pieces are loaded and evicted:
// reading an evicted or an unfilled piece would cause a step.
TEST(SoundLoader, ReplacesPiecesUnderJumpingVoicesWithoutAStepOrAPageFault) {
  const std::vector<SignalDescription> shapes(4, {1000 * kSecond_frames, true});
  const auto constant = [&](std::size_t signal, std::size_t block) -> Result<std::vector<float>> {
    return std::vector<float>(signal_block(shapes[signal].frames, block).frames, 0.5f);
  };
  SoundLoader loader(shapes, {}, kPlain, constant, {6'000'000, true}, 2, 2);
  Mixer mixer(loader.signals(), JumpingVoices::kCount, kPlain);
  JumpingVoices voices;
  mixer.begin(voices.keyframe(), 0);
  std::vector<float> both(2 * kMaxFrames);
  float last = 0, max_step = 0, loudest = 0;
  prefault_stack();  // like an audio thread
  long faults = 0;
  // Runs for as many segments as it takes, on a slow machine.
  const int segments = testing::kSanitized ? 300 : 3000;
  const auto goes_on = [&](int k) {
    return k < segments || (k < 20 * segments && loader.statistics().dropped < 30);
  };
  for (int k = 0; goes_on(k); ++k) {
    const Keyframe& keyframe = voices.next();
    loader.play(keyframe.voices);
    loader.mark_quiescent(mixer.clock_frames());
    const long before = page_faults();
    mixer.load(keyframe);
    while (!mixer.wants_keyframe()) {
      const int steps = mixer.steps_left();
      mixer.mix(both.data(), steps);
      for (int i = 0; i < steps * kStepFrames; ++i) {
        const float now = both[static_cast<std::size_t>(2 * i)];
        max_step = std::max(max_step, std::abs(now - last));
        loudest = std::max(loudest, now);
        last = now;
      }
    }
    if (k > 10) faults += page_faults() - before;
    if (testing::kSanitized || k % 4 == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(testing::kSanitized ? 5 : 1));
  }
  EXPECT_GT(loader.statistics().dropped, 20u);
  EXPECT_GT(loudest, 0.08f);  // at least one voice, which has 0.083
  // All voices together start from silence within 960 frames; one that is cut off would be a step
  // of 0.08.
  EXPECT_LT(max_step, 0.5f / kKeyframeFrames + 1e-5f);
  if (!testing::kSanitized) {
    EXPECT_EQ(faults, 0);
  }
}

}  // namespace
}  // namespace clamor
