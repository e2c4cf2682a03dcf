// auralizer_lacking_sounds_test.cpp: a crowd with many sounds, some of which are not in memory: a
// clock of blocks and a loader that the test calls.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/engine/heard_source.h"
#include "runtime/engine/memory_budget.h"
#include "runtime/streaming/sound_statistics.h"
#include "runtime/voices/keyframe.h"
#include "tests/baked_room.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

constexpr std::uint32_t kSounds = 24, kEmitters = 240;
constexpr int kVoices = 150;

// Loops of noise, 2 to 3 s long and each 0.5 dB quieter than the one before, which ten emitters
// each play in a room. Decoded they take 14 MB.
std::shared_ptr<const BakeFile> bake_crowd() {
  Level level =
      testing::shoebox({30, 10, 20}, testing::uniform_material(0.4f, 0.5f, 20), {15, 2, 10});
  level.signals.clear();
  for (std::uint32_t s = 0; s < kSounds; ++s) {
    Signal& signal = level.signals.emplace_back();
    signal.name = "sound " + std::to_string(s);
    signal.samples.resize(2 * kSampleRate_hz + s * 2000);
    const double amplitude = 0.5 * std::pow(10, -0.5 * s / 20);
    for (std::uint32_t i = 0; i < signal.samples.size(); ++i)
      signal.samples[i] = static_cast<float>(amplitude * (unit(philox(5, {i, s, 0, 0})[0]) - 0.5));
  }
  const Emitter one = level.emitters[0];
  level.emitters.clear();
  for (std::uint32_t e = 0; e < kEmitters; ++e) {
    const RandomBits bits = philox(6, {e, 0, 0, 0});
    Emitter& emitter = level.emitters.emplace_back(one);
    emitter.name = "fan " + std::to_string(e);
    emitter.position_m = {1 + 28 * unit(bits[0]), 1 + 2 * unit(bits[1]), 1 + 18 * unit(bits[2])};
    emitter.signal = e % kSounds;
    emitter.delay_s = 2 * unit(bits[3]);
  }
  BakeOptions options;
  options.settings.photons = 2000;
  options.settings.sources = 200;  // one page
  return testing::as_file(*bake(level, options));
}

std::shared_ptr<const BakeFile> crowd() {
  static const auto file = bake_crowd();
  return file;
}

AuralizerOptions options_with(std::uint64_t memory_bytes) {
  AuralizerOptions made;
  made.voices = kVoices;
  made.visibility = false;
  made.own_threads = false;
  made.first_sounds_s = 3600;  // however slow the machine is
  made.keeps_sample = true;
  made.memory_bytes = memory_bytes;
  return made;
}

// Plays a crowd, with the listener standing still, so that samples can be compared.
class Playing {
 public:
  Playing(const std::shared_ptr<const BakeFile>& file, const AuralizerOptions& options)
      : auralizer_(std::move(*Auralizer::create(file, options))) {}

  // Plays so many keyframes, after each of which `loads` pages or sounds arrive.
  void play(int keyframes, int loads) {
    std::vector<float> block(2 * kKeyframeFrames);
    power_ = 0;
    for (int k = 0; k < keyframes; ++k) {
      while (auralizer_->wants_keyframe()) auralizer_->make_keyframe({{14, 1.7, 9}, 0, 0});
      auralizer_->mix(block);
      for (const float sample : block)
        power_ += static_cast<double>(sample) * sample / kKeyframeFrames / keyframes;
      for (int i = 0; i < loads && auralizer_->load(); ++i) {
      }
    }
  }

  Auralizer& auralizer() { return *auralizer_; }
  double power() const { return power_; }  // of what was played last
  SoundStatistics sounds() { return auralizer_->statistics().sounds; }

  // The power of each source that has a voice.
  std::map<std::uint64_t, float> sample() const {
    std::map<std::uint64_t, float> powers;
    for (const HeardSource& heard : auralizer_->newest_sample()) powers[heard.number] = heard.power;
    return powers;
  }
  std::set<std::uint32_t> sounds_heard() const {
    std::set<std::uint32_t> heard;
    for (const HeardSource& one : auralizer_->newest_sample()) heard.insert(one.emitter % kSounds);
    return heard;
  }

  void mute_all_but(const std::set<std::uint32_t>& sounds) {
    std::vector<float> powers;
    for (std::uint32_t e = 0; e < kEmitters; ++e)
      powers.push_back(sounds.contains(e % kSounds) ? 1.0f : 0.0f);
    auralizer_->set_emitter_powers(std::move(powers));
  }

 private:
  const std::unique_ptr<Auralizer> auralizer_;
  double power_ = 0;
};

// The same crowd at the same time with all sounds in memory, of which only some are heard.
std::map<std::uint64_t, float> sample_of(const std::shared_ptr<const BakeFile>& file,
                                         const std::set<std::uint32_t>& heard, int keyframes) {
  AuralizerOptions all = options_with(0);
  all.wait_for_pages = true;
  Playing playing(file, all);
  playing.mute_all_but(heard);
  playing.play(keyframes, 0);
  return playing.sample();
}

void expect_same_sample(const std::map<std::uint64_t, float>& got,
                        const std::map<std::uint64_t, float>& expected) {
  ASSERT_EQ(got.size(), expected.size());
  for (const auto& [number, power] : expected) {
    ASSERT_TRUE(got.contains(number)) << number;
    EXPECT_NEAR(got.at(number) / power, 1, 1e-5) << number;
  }
}

TEST(CrowdSounds, FitIntoTheDefaultMemoryAndSilenceNoVoice_NoAsan_NoTsan) {
  const auto file = crowd();
  std::set<std::uint32_t> all;
  for (std::uint32_t s = 0; s < kSounds; ++s) all.insert(s);
  Playing playing(file, options_with(0));
  playing.play(150, 1);
  const SoundStatistics sounds = playing.sounds();
  EXPECT_EQ(sounds.late, 0u);
  EXPECT_EQ(sounds.over_budget, 0u);
  EXPECT_EQ(sounds.dropped, 0u);
  EXPECT_GT(sounds.all_bytes, kMinSounds_bytes);
  EXPECT_LE(sounds.all_bytes, sounds.budget_bytes);
  expect_same_sample(playing.sample(), sample_of(file, all, 150));
}

TEST(CrowdSounds, LeaveTheirVoicesToOthersUntilTheyArrive_NoAsan_NoTsan) {
  const auto file = crowd();
  Playing playing(file, options_with(0));
  const std::set<std::uint32_t> first = {0, 3, 4, 7, 11, 12, 18, 21};
  std::set<std::uint32_t> all;
  for (std::uint32_t s = 0; s < kSounds; ++s) all.insert(s);
  playing.mute_all_but(first);
  playing.play(50, 0);
  ASSERT_EQ(playing.sounds_heard(), first);
  // The other emitters begin, but the disk stands still.
  playing.mute_all_but(all);
  playing.play(50, 0);
  EXPECT_EQ(playing.sounds_heard(), first);
  expect_same_sample(playing.sample(), sample_of(file, first, 100));
  EXPECT_GT(playing.sounds().handed_over, 40u);
  const double without = playing.power();
  // It works again.
  playing.play(50, 1);
  playing.play(50, 0);
  EXPECT_GT(playing.sounds_heard().size(), 2 * first.size());
  expect_same_sample(playing.sample(), sample_of(file, all, 200));
  EXPECT_GT(playing.power(), 1.5 * without);
  EXPECT_EQ(playing.sounds().late, 0u);
}

TEST(CrowdSounds, ThatDoNotFitLeaveTheirVoicesToTheLoudest_NoAsan_NoTsan) {
  const auto file = crowd();
  Playing playing(file, options_with(1'000'000));
  playing.play(200, 1);
  const SoundStatistics sounds = playing.sounds();
  EXPECT_EQ(sounds.late, 0u);
  EXPECT_GT(sounds.over_budget, 0u);
  EXPECT_LE(sounds.max_bytes, kMinSounds_bytes);
  const std::set<std::uint32_t> heard = playing.sounds_heard();
  EXPECT_GT(heard.size(), kSounds / 3);
  EXPECT_LT(heard.size(), kSounds * 3 / 4);
  expect_same_sample(playing.sample(), sample_of(file, heard, 200));
  EXPECT_EQ(playing.sample().size(), static_cast<std::size_t>(kVoices));
  // Ten emitters each: the nearest ones count more than half a decibel, but not in the sum.
  double place = 0;
  for (const std::uint32_t sound : heard) place += sound;
  EXPECT_LT(place / static_cast<double>(heard.size()), 0.8 * (kSounds - 1) / 2);
}

}  // namespace
}  // namespace clamor
