// auralizer_load_test.cpp: the whole engine with a sampler and a mixer that take as long as the
// test says.
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/mixing/load_control.h"
#include "runtime/voices/keyframe.h"
#include "tests/baked_room.h"
#include "tools/analysis/click_detector.h"

namespace clamor {
namespace {

constexpr double kLoadBlock_s = 256.0 / kSampleRate_hz;

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
    options.moving.max_sources = 1;  // so no keyframes share a sample: k alone follows the load
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
    for (double played_s = 0; played_s < seconds; played_s += kLoadBlock_s) {
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

TEST(AuralizerLoad, ASlowSamplerDrawsFewerSourcesAtTheSameLevelAndRecovers_NoAsan) {
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

TEST(AuralizerLoad, ASlowMixerShedsVoicesUntilTheSamplerDrawsFewer_NoAsan) {
  Adapting slow(noisy_room(), kLoadVoices), quick(noisy_room(), kLoadVoices, false);
  slow.play(0.5);
  quick.play(0.5);
  slow.audio.per_voice_s = 1.3 * kLoadBlock_s / kLoadVoices;
  // The load is measured over a keyframe's time, after one that may have been measured in part.
  int blocks = 0;
  while (slow.auralizer->statistics().shed_voices == 0 && blocks < 8) {
    slow.play(kLoadBlock_s);
    ++blocks;
  }
  const AuralizerStatistics shed = slow.auralizer->statistics();
  // As many voices are mixed as take the target share, up to the resolution of 255 ranks.
  EXPECT_NEAR(shed.voices - shed.shed_voices, kLoadVoices * kAimShare / 1.3,
              5 * kLoadVoices / 255.0);
  EXPECT_EQ(shed.k, std::uint32_t{kLoadVoices}) << "the sampler cannot know yet";
  slow.play(2);
  quick.play(2 + blocks * kLoadBlock_s);
  const AuralizerStatistics settled = slow.auralizer->statistics();
  EXPECT_EQ(settled.shed_voices, 0u);
  EXPECT_EQ(settled.late_keyframes, 0u);
  EXPECT_NEAR(settled.k, kLoadVoices * kAimShare / 1.3, 0.1 * kLoadVoices);
  EXPECT_NEAR(power_db(slow.play(2)), power_db(quick.play(2)),
              3 * 4.34 / std::sqrt(0.5 * kLoadVoices));

  slow.audio.per_voice_s = 0.2 * kLoadBlock_s / kLoadVoices;
  slow.play(20);
  EXPECT_EQ(slow.auralizer->statistics().k, std::uint32_t{kLoadVoices});
  EXPECT_EQ(slow.auralizer->statistics().shed_voices, 0u);
}

// The cost is too high for all voices, but not for as many as the limit allows now.
TEST(AuralizerLoad, ASlightlySlowMixerGetsAsManyVoicesAsFit_NoAsan) {
  Adapting slow(noisy_room(), kLoadVoices);
  slow.play(0.5);
  slow.audio.per_voice_s = 1.3 * kLoadBlock_s / kLoadVoices;
  slow.play(2);
  const AuralizerStatistics fallen = slow.auralizer->statistics();
  slow.audio.per_voice_s = 1.0 * kLoadBlock_s / kLoadVoices;
  slow.play(5);
  for (int i = 0; i < 20; ++i) {
    slow.play(1);
    const AuralizerStatistics now = slow.auralizer->statistics();
    EXPECT_NEAR(now.k, kLoadVoices * kLowShare, 0.05 * kLoadVoices) << i;
    EXPECT_EQ(now.shedding_blocks, fallen.shedding_blocks) << i;
  }
}

// A sampler's thread that waits for a core for most of the time.
struct WaitingClock {
  double now_s = 0, cpu_s = 0, takes_s = 0.03;

  LoadClock clock() {
    return {[](void* self) noexcept {
              auto& waiting = *static_cast<WaitingClock*>(self);
              waiting.cpu_s += waiting.takes_s / 30;
              return waiting.now_s += waiting.takes_s;
            },
            this,
            [](void* self, clockid_t) noexcept { return static_cast<WaitingClock*>(self)->cpu_s; }};
  }
};

TEST(AuralizerLoad, ASamplerThatWaitsForACoreSharesSamplesAmongKeyframes_NoAsan) {
  Adapting slow(noisy_room(), kLoadVoices);
  WaitingClock clock;
  AuralizerOptions options;
  options.voices = kLoadVoices;
  options.block_frames = 256;
  options.adapt = true;
  options.sampler_clock = clock.clock();
  options.audio_clock = slow.audio.clock();
  slow.auralizer = *Auralizer::create(noisy_room(), options);
  slow.audio.auralizer = slow.auralizer.get();
  slow.play(0.02);
  EXPECT_EQ(slow.auralizer->statistics().keyframes_per_sample, 1u);
  slow.play(3);
  const AuralizerStatistics waiting = slow.auralizer->statistics();
  EXPECT_EQ(waiting.keyframes_per_sample, kMaxKeyframesPerSample);
  EXPECT_EQ(waiting.starved_keyframes, waiting.late_keyframes);
  EXPECT_NEAR(waiting.waiting_share, 1 - 1 / 30.0, 1e-6);
  clock.takes_s = 0.0001;
  slow.play(4);
  EXPECT_EQ(slow.auralizer->statistics().keyframes_per_sample, 1u);
  EXPECT_EQ(slow.auralizer->statistics().k, std::uint32_t{kLoadVoices});
}

TEST(AuralizerLoad, ASlowSamplerRenewsAFieldLessOftenBeforeItDrawsFewerSources_NoAsan) {
  Adapting slow(noisy_room(), kLoadVoices), quick(noisy_room(), kLoadVoices, false);
  AuralizerOptions options;
  options.voices = kLoadVoices;
  options.block_frames = 256;
  options.adapt = true;
  options.mixing = Mixing::kField;
  options.sampler_clock = slow.sampler.clock();
  options.audio_clock = slow.audio.clock();
  slow.auralizer = *Auralizer::create(noisy_room(), options);
  slow.sampler.auralizer = slow.audio.auralizer = slow.auralizer.get();
  const auto walk = [](Adapting& who, int keyframes) {
    std::vector<float> out;
    for (int step = 0; step < keyframes; ++step) {
      who.pose.position_m.x += 0.01;
      const auto part = who.play(kKeyframe_s);
      out.insert(out.end(), part.begin(), part.end());
    }
    return out;
  };
  walk(slow, 75);
  walk(quick, 75);
  EXPECT_EQ(slow.auralizer->statistics().keyframes_per_sample, 4u);
  // A keyframe with a new sample takes longer than its period, and the others do not.
  slow.sampler.per_voice_s = 0.28 * kKeyframe_s / kLoadVoices;
  const double coarse_db = power_db(walk(slow, 15));
  const AuralizerStatistics late = slow.auralizer->statistics();
  EXPECT_GT(late.keyframes_per_sample, 4u);
  EXPECT_EQ(late.k, std::uint32_t{kLoadVoices});
  EXPECT_NEAR(coarse_db, power_db(walk(quick, 15)), 1);
  slow.sampler.per_voice_s = 0;
  walk(slow, 150);
  EXPECT_EQ(slow.auralizer->statistics().keyframes_per_sample, 4u);
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

TEST(AuralizerLoad, VoicesAreShedAndReturnWithoutClicks_NoAsan) {
  const AuralizerInput input = toned_room();
  Adapting quick(input, kLoadVoices, false);
  for (const bool binaural : {false, true}) {
    Adapting slow(input, kLoadVoices, true, binaural);
    std::vector<float> out = slow.play(1);
    const auto on = [&out, &slow](double share, double seconds) {
      slow.audio.per_voice_s = share * kLoadBlock_s / kLoadVoices;
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

TEST(AuralizerLoad, ChangesNothingWhileThereIsTime_NoAsan) {
  Adapting adapting(noisy_room(), 300), plain(noisy_room(), 300, false);
  adapting.audio.per_voice_s = 0.7 * kLoadBlock_s / 300;
  adapting.sampler.per_voice_s = 0.7 * 0.02 / 300;
  EXPECT_EQ(adapting.play(1), plain.play(1));
}

// While the sampler stalls, the mixer holds the last keyframe and sheds voices of it.
TEST(AuralizerLoad, TheMixerShedsVoicesWhileTheSamplerStalls_NoAsan) {
  for (const bool binaural : {false, true}) {  // binaural voices have all bands of an HRTF
    Adapting slow(toned_room(), kLoadVoices, true, binaural);
    std::vector<float> out = slow.play(0.5);
    slow.audio.per_voice_s = 1.3 * kLoadBlock_s / kLoadVoices;
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
