#include "runtime/mixing/load_control.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/measures/click_detector.h"
#include "runtime/player/render.h"
#include "tests/baked_room.h"

namespace clamor {
namespace {

constexpr double kBlock_s = 256.0 / kSampleRate_hz;

// A machine that spends a given share of a block's time on each voice and mixes as many voices as
// allowed.
struct Machine {
  MixerLoadControl load{};
  double share_per_voice = 0;
  std::size_t voices = 2000;  // in each keyframe
  int late_blocks = 0;

  double mix_block() {
    load.expect(voices);
    const std::size_t mixed = std::min(voices, load.allowed());
    const double share = share_per_voice * static_cast<double>(mixed);
    late_blocks += share > 1;
    load.mixed(share * kBlock_s, kBlock_s, mixed);
    return share;
  }
};

TEST(MixerLoadControl, IsUnlimitedWhileThereIsTime) {
  Machine machine{.share_per_voice = 0.8 / 2000};
  for (int block = 0; block < 1000; ++block) machine.mix_block();
  EXPECT_EQ(machine.load.allowed(), MixerLoadControl::kUnlimited);
}

TEST(MixerLoadControl, LetsNoBlockBeLateWhileTheCostGrows) {
  Machine machine{.share_per_voice = 0.3 / 2000};
  // The cost of a voice grows by 2 % per block, eightfold in the end.
  for (int block = 0; block < 105; ++block) {
    machine.mix_block();
    machine.share_per_voice *= 1.02;
  }
  EXPECT_EQ(machine.late_blocks, 0);
  EXPECT_NEAR(machine.mix_block(), kAimShare, kHighShare - kAimShare);
}

TEST(MixerLoadControl, LetsNoBlockBeLateWhenTooManyVoicesAreAdded) {
  Machine machine{.share_per_voice = 0.5 / 2000};
  for (int block = 0; block < 200; ++block) machine.mix_block();
  machine.voices = 20'000;
  for (int block = 0; block < 200; ++block) machine.mix_block();
  EXPECT_EQ(machine.late_blocks, 0);
  EXPECT_NEAR(machine.mix_block(), kAimShare, 0.01);
}

TEST(MixerLoadControl, LetsOneBlockBeLateWhenTheCostRisesByHalf) {
  Machine machine{.share_per_voice = 0.8 / 2000};
  for (int block = 0; block < 200; ++block) machine.mix_block();
  machine.share_per_voice *= 1.5;
  for (int block = 0; block < 2000; ++block) machine.mix_block();
  EXPECT_EQ(machine.late_blocks, 1);
  EXPECT_NEAR(static_cast<double>(machine.load.allowed()), 2000 * kAimShare / 1.2, 1);
}

TEST(MixerLoadControl, IgnoresASingleSlowBlockThatWasInTime) {
  Machine machine{.share_per_voice = 0.6 / 2000};
  for (int block = 0; block < 500; ++block) {
    machine.share_per_voice = (block % 10 == 9 ? 0.97 : 0.6) / 2000;
    machine.mix_block();
    ASSERT_EQ(machine.load.allowed(), MixerLoadControl::kUnlimited) << block;
  }
  // Two slow blocks in succession lower the limit before a block is late.
  machine.share_per_voice = 0.97 / 2000;
  for (int block = 0; block < 100; ++block) machine.mix_block();
  EXPECT_LT(machine.load.allowed(), 2000u);
  EXPECT_EQ(machine.late_blocks, 0);
}

TEST(MixerLoadControl, DoublesTheLimitInHalfTheUsualTimeWhenMuchTimeIsLeft) {
  Machine machine{.share_per_voice = 1.6 / 2000};
  machine.mix_block();
  const double least = static_cast<double>(machine.load.allowed());
  machine.share_per_voice = 0.2 / 2000;  // enough time left to double the rate
  double seconds = 0;
  for (; seconds < Backoff::kLeast_s - kBlock_s; seconds += kBlock_s) machine.mix_block();
  EXPECT_EQ(static_cast<double>(machine.load.allowed()), least) << "it waits for what comes";
  for (; seconds < Backoff::kLeast_s + MixerLoadControl::kDouble_s / 2; seconds += kBlock_s)
    machine.mix_block();
  // Whole blocks are counted: up to one more at either end of the rise, 1.06 % each.
  const double two_blocks = std::exp2(2 * 2 * kBlock_s / MixerLoadControl::kDouble_s);
  EXPECT_GE(static_cast<double>(machine.load.allowed()), 2 * least / two_blocks);
  EXPECT_LE(static_cast<double>(machine.load.allowed()), 2 * least * two_blocks);
  for (; seconds < Backoff::kLeast_s + 3 * MixerLoadControl::kDouble_s; seconds += kBlock_s)
    machine.mix_block();
  EXPECT_EQ(machine.load.allowed(), MixerLoadControl::kUnlimited);
}

TEST(MixerLoadControl, DoesNotAttributeTheFixedCostOfABlockToItsVoices) {
  MixerLoadControl load{};
  // There are ten voices, and filters take a fifth of the time.
  for (int block = 0; block < 100; ++block) load.mixed(0.2 * kBlock_s, kBlock_s, 10);
  load.expect(2000);
  EXPECT_EQ(load.allowed(), MixerLoadControl::kUnlimited);
}

TEST(SamplerLoadControl, FallsOnceToWhatFitsAndStays) {
  SamplerLoadControl limit(2000);
  for (int keyframe = 0; keyframe < 1000; ++keyframe)
    limit.keyframe_took(1.2 * static_cast<double>(limit.voices()) / 2000, 0, false);
  // The limit falls once, to the target share.
  EXPECT_EQ(limit.voices(), static_cast<std::size_t>(2000 * kAimShare / 1.2));
  EXPECT_EQ(limit.late(), 1u);
}

TEST(SamplerLoadControl, IgnoresASingleSlowKeyframeThatWasInTime) {
  SamplerLoadControl limit(2000);
  for (int keyframe = 0; keyframe < 100; ++keyframe)
    limit.keyframe_took(keyframe % 2 == 0 ? 0.99 : 0.89, 0, false);
  EXPECT_EQ(limit.voices(), 2000u);
  limit.keyframe_took(0.95, 0, false);
  EXPECT_EQ(limit.voices(), 2000u);
  limit.keyframe_took(0.95, 0, false);
  EXPECT_LT(limit.voices(), 2000u) << "two running";
  EXPECT_EQ(limit.late(), 0u);
}

TEST(SamplerLoadControl, RecoversWithinTwoSecondsAfterALateKeyframe) {
  SamplerLoadControl limit(2000);
  limit.keyframe_took(30, 0, false);
  EXPECT_EQ(limit.voices(), 1000u);  // one measurement removes at most half
  int keyframes = 0;
  while (limit.voices() < 2000 && keyframes < 100) {
    const std::size_t before = limit.voices();
    limit.keyframe_took(0.2, 0, false);
    EXPECT_LE(static_cast<double>(limit.voices() - before), 0.021 * static_cast<double>(before));
    ++keyframes;
  }
  EXPECT_LT(keyframes, 100);
  EXPECT_EQ(limit.min_so_far(), 1000u);
}

TEST(SamplerLoadControl, FollowsTheMixerDownAndThenWaits) {
  SamplerLoadControl limit(2000);
  for (int keyframe = 0; keyframe < 10; ++keyframe) limit.keyframe_took(0.1, 0.25, true);
  EXPECT_EQ(limit.voices(), 1500u);
  for (int keyframe = 0; keyframe < 100; ++keyframe) limit.keyframe_took(0.1, 0, true);
  EXPECT_EQ(limit.voices(), 1500u) << "though the mixer takes no more";
}

TEST(SamplerLoadControl, HasALowerBound) {
  SamplerLoadControl limit(2000);
  for (int keyframe = 0; keyframe < 100; ++keyframe) limit.keyframe_took(50, 0, false);
  EXPECT_EQ(limit.voices(), 2000u / SamplerLoadControl::kFloor);
}

// ---- Whole engine: a sampler and a mixer that take as long as the test says ---------------------

// A clock that advances by a given time per voice since the last reading.

// Time that passes with what was done: so much for each voice since the last reading.
struct WorkClock {
  double now_s = 0, per_voice_s = 0;
  Auralizer* auralizer = nullptr;
  std::uint32_t (*done)(const AuralizerStatistics&) = nullptr;

  LoadClock clock() {
    return {[](void* context) noexcept {
              auto& self = *static_cast<WorkClock*>(context);
              if (self.auralizer != nullptr)
                self.now_s += self.per_voice_s * self.done(self.auralizer->statistics());
              return self.now_s;
            },
            this};
  }
};

constexpr int kLoadVoices = 400;

struct Adapting {
  WorkClock sampler, audio;
  std::unique_ptr<Auralizer> auralizer;
  Listener pose{{3, 4, 1.5}, 0.3, 0};

  Adapting(AuralizerInput input, int voices, bool adapt = true, bool binaural = false) {
    AuralizerOptions options;
    if (binaural) options.output = *OutputFormat::from_options(true, "", false);
    options.voices = voices;
    options.block_frames = 256;
    options.adapt = adapt;
    options.sampler_clock = sampler.clock();
    options.audio_clock = audio.clock();
    auto made = Auralizer::create(std::move(input), options);
    EXPECT_TRUE(made.ok());
    auralizer = std::move(*made);
    sampler.auralizer = audio.auralizer = auralizer.get();
    sampler.done = [](const AuralizerStatistics& now) { return now.k; };
    audio.done = [](const AuralizerStatistics& now) { return now.voices - now.shed_voices; };
  }

  std::vector<float> play(double seconds) {
    std::vector<float> out;
    std::vector<float> block(512);
    for (double played_s = 0; played_s < seconds; played_s += kBlock_s) {
      while (auralizer->wants_keyframe()) auralizer->make_keyframe(pose);
      auralizer->mix(block);
      out.insert(out.end(), block.begin(), block.end());
    }
    return out;
  }
};

double power_db(std::span<const float> samples) {
  double sum = 0;
  for (const float sample : samples) sum += static_cast<double>(sample) * sample;
  return 10 * std::log10(sum / static_cast<double>(samples.size()));
}

// Stationary and mutually uncorrelated sounds.
AuralizerInput noisy_room() {
  AuralizerInput input = testing::baked_room(1000);
  for (std::uint32_t s = 0; s < input.signals.size(); ++s) {
    input.signals[s].loop = true;
    input.signals[s].samples.resize(48000 + 1000 * s);
    for (std::uint32_t i = 0; i < input.signals[s].samples.size(); ++i)
      input.signals[s].samples[i] = static_cast<float>(unit(philox(11, {i, s, 0, 0})[0]) - 0.5);
  }
  return input;
}

TEST(AuralizerLoad, ASlowSamplerDrawsFewerSourcesAtTheSameLevelAndRecovers) {
  Adapting slow(noisy_room(), kLoadVoices), quick(noisy_room(), kLoadVoices, false);
  slow.play(0.5);
  quick.play(0.5);
  // a keyframe of all voices would take two periods
  slow.sampler.per_voice_s = 2 * 0.02 / kLoadVoices;
  slow.play(1);
  quick.play(1);
  const AuralizerStatistics late = slow.auralizer->statistics();
  EXPECT_GE(late.late_keyframes, 1u);
  EXPECT_LE(late.late_keyframes, 2u);
  // One measurement removes at most half; the target share removes the rest.
  EXPECT_NEAR(late.k, kLoadVoices * 0.5 * kAimShare, 1);
  const double few_db = power_db(slow.play(2)), all_db = power_db(quick.play(2));
  // One standard deviation of the sample is 4.34 / sqrt(k - 1) dB; the mean of 2 s adds 0.05 dB.
  EXPECT_NEAR(few_db, all_db, 3 * 4.34 / std::sqrt(0.35 * kLoadVoices));

  slow.sampler.per_voice_s = 0.2 * 0.02 / kLoadVoices;
  slow.play(8);
  EXPECT_EQ(slow.auralizer->statistics().k, std::uint32_t{kLoadVoices});
  EXPECT_EQ(slow.auralizer->statistics().min_k, late.k);
}

TEST(AuralizerLoad, ASlowMixerShedsVoicesUntilTheSamplerDrawsFewer) {
  Adapting slow(noisy_room(), kLoadVoices), quick(noisy_room(), kLoadVoices, false);
  slow.play(0.5);
  quick.play(0.5);
  slow.audio.per_voice_s = 1.3 * kBlock_s / kLoadVoices;
  slow.play(2 * kBlock_s);
  const AuralizerStatistics shed = slow.auralizer->statistics();
  // As many voices are mixed as take the target share, up to the resolution of 255 ranks.
  EXPECT_NEAR(shed.shed_voices, kLoadVoices * (1 - kAimShare / 1.3), 5 * kLoadVoices / 255.0);
  EXPECT_EQ(shed.k, std::uint32_t{kLoadVoices}) << "the sampler does not know yet";
  slow.play(2);
  quick.play(2 + 2 * kBlock_s);
  const AuralizerStatistics settled = slow.auralizer->statistics();
  EXPECT_EQ(settled.shed_voices, 0u);
  EXPECT_EQ(settled.late_keyframes, 0u);
  EXPECT_NEAR(settled.k, kLoadVoices * kAimShare / 1.3, 0.1 * kLoadVoices);
  EXPECT_NEAR(power_db(slow.play(2)), power_db(quick.play(2)),
              3 * 4.34 / std::sqrt(0.5 * kLoadVoices));

  slow.audio.per_voice_s = 0.2 * kBlock_s / kLoadVoices;
  slow.play(20);
  EXPECT_EQ(slow.auralizer->statistics().k, std::uint32_t{kLoadVoices});
  EXPECT_EQ(slow.auralizer->statistics().shed_voices, 0u);
}

// The cost is too high for all voices, but not for as many as the limit allows now.
TEST(AuralizerLoad, ASlightlySlowMixerGetsAsManyVoicesAsFit) {
  Adapting slow(noisy_room(), kLoadVoices);
  slow.play(0.5);
  slow.audio.per_voice_s = 1.3 * kBlock_s / kLoadVoices;
  slow.play(2);
  const AuralizerStatistics fallen = slow.auralizer->statistics();
  slow.audio.per_voice_s = 1.0 * kBlock_s / kLoadVoices;
  slow.play(5);
  for (int i = 0; i < 20; ++i) {
    slow.play(1);
    const AuralizerStatistics now = slow.auralizer->statistics();
    EXPECT_NEAR(now.k, kLoadVoices * kLowShare, 0.05 * kLoadVoices) << i;
    EXPECT_EQ(now.shedding_blocks, fallen.shedding_blocks) << i;
  }
}

// Tones, in which any step is a click, over noise 54 dB below. Without the noise even the end of a
// fade of half of all voices within 10 ms would be found.
AuralizerInput toned_room() {
  AuralizerInput input = testing::baked_room(1000);
  Signal tone = testing::sine(200);
  for (std::uint32_t i = 0; i < tone.samples.size(); ++i)
    tone.samples[i] += 2.5e-3f * static_cast<float>(unit(philox(12, {i, 0, 0, 0})[0]) - 0.5);
  input.signals.assign(3, tone);
  return input;
}

// Clicks in the left channel.
std::vector<Click> clicks_in_left_channel(const std::vector<float>& out) {
  std::vector<float> left;
  float peak = 0;
  for (std::size_t i = 0; i < out.size(); i += 2) left.push_back(out[i]);
  for (const float sample : left) peak = std::max(peak, std::abs(sample));
  EXPECT_GT(peak, 0.01f);
  return find_clicks(left, 1e-4 * static_cast<double>(peak));
}

TEST(AuralizerLoad, VoicesAreShedAndReturnWithoutClicks) {
  const AuralizerInput input = toned_room();
  Adapting quick(input, kLoadVoices, false);
  for (const bool binaural : {false, true}) {
    Adapting slow(input, kLoadVoices, true, binaural);
    std::vector<float> out = slow.play(1);
    const auto on = [&out, &slow](double share, double seconds) {
      slow.audio.per_voice_s = share * kBlock_s / kLoadVoices;
      const auto more = slow.play(seconds);
      out.insert(out.end(), more.begin(), more.end());
    };
    on(1.6, 0.5);
    const std::uint64_t shedding = slow.auralizer->statistics().shedding_blocks;
    on(3, 0.3);
    on(0.1, 15);
    const AuralizerStatistics now = slow.auralizer->statistics();
    EXPECT_GT(shedding, 2u);
    EXPECT_GT(now.max_shed_voices, kLoadVoices / 3u);
    EXPECT_EQ(now.k, std::uint32_t{kLoadVoices});
    EXPECT_EQ(now.shed_voices, 0u);

    for (const Click& click : clicks_in_left_channel(out))
      ADD_FAILURE() << "a click of " << click.sigmas << " sigmas at frame " << click.frame
                    << (binaural ? ", binaural" : "");
  }

  // The detector finds an abrupt loss of a tenth of the mix.
  std::vector<float> torn = quick.play(1);
  for (std::size_t i = torn.size() / 2; i < torn.size(); ++i) torn[i] *= 0.9f;
  EXPECT_EQ(clicks_in_left_channel(torn).size(), 1u);
}

TEST(AuralizerLoad, ChangesNothingWhileThereIsTime) {
  Adapting adapting(noisy_room(), 300), plain(noisy_room(), 300, false);
  adapting.audio.per_voice_s = 0.7 * kBlock_s / 300;
  adapting.sampler.per_voice_s = 0.7 * 0.02 / 300;
  EXPECT_EQ(adapting.play(1), plain.play(1));
}

// While the sampler stalls, the mixer holds the last keyframe and sheds voices of it.
TEST(AuralizerLoad, TheMixerShedsVoicesWhileTheSamplerStalls) {
  for (const bool binaural : {false, true}) {  // binaural voices have all bands of an HRTF
    Adapting slow(toned_room(), kLoadVoices, true, binaural);
    std::vector<float> out = slow.play(0.5);
    slow.audio.per_voice_s = 1.3 * kBlock_s / kLoadVoices;
    std::vector<float> block(512);
    for (int b = 0; b < 200; ++b) {
      slow.auralizer->mix(block);
      out.insert(out.end(), block.begin(), block.end());
    }
    EXPECT_NEAR(slow.auralizer->statistics().shed_voices, kLoadVoices * (1 - kAimShare / 1.3),
                5 * kLoadVoices / 255.0);
    EXPECT_TRUE(clicks_in_left_channel(out).empty()) << binaural;
  }
}

}  // namespace
}  // namespace clamor
