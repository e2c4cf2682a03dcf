// block_mixer_test.cpp: the cost of an audio callback, counted in operations rather than measured
// in time.
#include "runtime/mixing/block_mixer.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "runtime/mixing/panner.h"
#include "tests/rooms.h"
#include "tests/runtime/hrtf_mixing.h"

namespace clamor {
namespace {

// A clock by which some blocks take far longer than their duration.
struct BusyClock {
  double time_s = 0;
  std::mt19937 random{9};

  static double now(void* context) noexcept REALTIME {
    auto& clock = *static_cast<BusyClock*>(context);
    return clock.time_s += clock.random() % 4 == 0 ? 0.03 : 0.001;
  }
};

enum class Output : std::uint8_t { kPair, kLoudspeakers, kHead };

class Callbacks {
 public:
  static constexpr std::uint32_t kSlots = 120;

  Callbacks(Output output, bool busy)
      : panner_(output == Output::kLoudspeakers ? make_loudspeaker_panner(*find_layout("5.1"))
                                                : nullptr) {
    if (panner_ != nullptr) {
      mode_.delays = 1;
      mode_.pairs = panner_->channels() / kEars;
    }
    mode_.head = output == Output::kHead;
    mode_.narrowband_voices = 20;
    signals_ = prepare_signals(std::vector<Signal>{testing::sine(200), testing::sine(300)}, mode_);
    mixer_ = std::make_unique<BlockMixer>(
        signals_, kSlots, mode_, panner_.get(), mode_.head ? &testing::kemar_head() : nullptr,
        nullptr,
        BlockOptions{.adapt = busy, .block_frames = 4096, .clock = {BusyClock::now, &clock_}});
  }

  // Number of mixes of each voice and frame: one per pair of channels, or with an HRTF one in
  // narrow bands and one in octaves, because a voice crossfades between the two.
  std::uint64_t max_banks() const {
    return mode_.head ? 2 : static_cast<std::uint64_t>(mode_.pairs);
  }

  // Publishes a keyframe with random voices: they start, end, turn, jump, and have any level.
  void publish(std::uint32_t min_voices) {
    Keyframe& keyframe = *mixer_->writable();
    keyframe.number = number_++;
    keyframe.voices.clear();
    for (std::uint32_t s = 0; s < kSlots; ++s) {
      if (s >= min_voices && random_() % 3 == 0) {
        sounding_[s] = false;
        continue;
      }
      Voice& voice = keyframe.voices.emplace_back();
      voice.slot = s;
      voice.signal = s % 2;
      voice.starts = !sounding_[s];
      sounding_[s] = true;
      voice.rank = static_cast<std::uint8_t>(random_() % 256);
      std::normal_distribution<float> normal;
      voice.from = normalize(Vec3f(normal(random_), normal(random_), normal(random_)));
      for (std::size_t e = 0; e < kEars; ++e) {
        voice.start_delay_frames[e] = voice.delay_frames[e] = 100.0 * s + random_() % 900;
        voice.gain[e] = same_in_all_bands(static_cast<float>(1 + random_() % 9) * 1e-3f);
      }
    }
    mixer_->publish(keyframe);
  }
  BlockMixer& mixer() { return *mixer_; }
  std::mt19937& random() { return random_; }

 private:
  MixMode mode_;
  std::unique_ptr<const Panner> panner_;
  std::vector<PreparedSignal> signals_;
  BusyClock clock_;
  std::unique_ptr<BlockMixer> mixer_;
  std::mt19937 random_{3};
  std::uint64_t number_ = 0;
  std::array<bool, kSlots> sounding_{};
};

class Work : public ::testing::TestWithParam<Output> {};

// Whatever keyframes contain, however late they are and whatever is shed, a block of n frames mixes
// at most n + 63 frames per voice and filter bank, and loads each voice once per 960 frames plus
// once.
TEST_P(Work, IsBoundedByVoicesTimesFrames_NoAsan) {
  for (const bool busy : {false, true}) {
    Callbacks callbacks(GetParam(), busy);
    BlockMixer& mixer = callbacks.mixer();
    std::vector<float> block;
    std::uint64_t done = 0, frames_in_all = 0;
    for (int call = 0; call < 500; ++call) {
      // Keyframes are sometimes late, by several periods.
      if (call % 50 < 40)
        while (mixer.wants_keyframe()) callbacks.publish(0);
      constexpr std::uint64_t kSizes[] = {1, 16, 63, 64, 65, 256, 480, 1024, 4096};
      const std::uint64_t frames = kSizes[callbacks.random()() % std::size(kSizes)];
      block.resize(frames * mixer.channels());
      const Mixer::Work before = mixer.work();
      mixer.mix(block);
      const Mixer::Work now = mixer.work();
      const std::uint64_t max_frames = frames + kStepFrames - 1;
      ASSERT_LE(now.voice_frames - before.voice_frames,
                Callbacks::kSlots * max_frames * callbacks.max_banks())
          << frames << " frames";
      ASSERT_LE(now.loaded_voices - before.loaded_voices,
                Callbacks::kSlots * (max_frames / kKeyframeFrames + 1))
          << frames << " frames";
      done += now.voice_frames - before.voice_frames;
      frames_in_all += frames;
    }
    EXPECT_GT(done, frames_in_all * Callbacks::kSlots / (busy ? 50 : 3)) << "nothing was mixed";
    EXPECT_EQ(mixer.statistics().shedding_blocks > 0, busy);
    EXPECT_GT(mixer.statistics().held_blocks, 0u);
  }
}

// Nothing is shed while there is time, so the work reaches the bound.
TEST_P(Work, IncludesAllVoicesWhileThereIsTime) {
  Callbacks callbacks(GetParam(), false);
  BlockMixer& mixer = callbacks.mixer();
  std::vector<float> block(kKeyframeFrames * mixer.channels());
  for (int call = 0; call < 50; ++call) {
    while (mixer.wants_keyframe()) callbacks.publish(Callbacks::kSlots);
    const Mixer::Work before = mixer.work();
    mixer.mix(block);
    const Mixer::Work now = mixer.work();
    EXPECT_GE(now.voice_frames - before.voice_frames,
              std::uint64_t{Callbacks::kSlots} * kKeyframeFrames);
    EXPECT_EQ(now.loaded_voices - before.loaded_voices, Callbacks::kSlots);
  }
}

INSTANTIATE_TEST_SUITE_P(Callback, Work,
                         ::testing::Values(Output::kPair, Output::kLoudspeakers, Output::kHead));

}  // namespace
}  // namespace clamor
