#include <gtest/gtest.h>

#include "runtime/mixing/mixer.h"
#include "runtime/streaming/sound_loader.h"
#include "tests/realtime/forbidden.h"

namespace clamor {
namespace {

using testing::Forbidden;

// Sounds begin, end and are late while the mixer holds.
TEST(AudioThread, AllocatesNothingAndLocksNothingWhileSoundsComeAndGo) {
  const std::vector<SignalDescription> shapes = {{1000 * std::uint64_t{kSampleRate_hz}, true},
                                                 {30 * std::uint64_t{kSampleRate_hz}, false}};
  const auto decode = [&](std::size_t signal, std::size_t block) -> Result<std::vector<float>> {
    if (block == 1) return Error("is damaged");
    return std::vector<float>(signal_block(shapes[signal].frames, block).frames, 0.5f);
  };
  SoundLoader loader(shapes, {}, MixMode{}, decode, {4'000'000, true}, 2);
  Keyframe keyframe;
  for (std::uint32_t s = 0; s < 4; ++s) {
    Voice& voice = keyframe.voices.emplace_back();
    voice.slot = s;
    voice.signal = s / 3;
    for (Bands& ear : voice.gain) ear.fill(0.3f);
  }
  Mixer mixer(loader.signals(), 4);
  mixer.begin(keyframe, 0);
  std::array<float, 2 * kMaxFrames> out{};
  float loudest = 0;
  for (int k = 0; k < 3000; ++k) {
    for (Voice& voice : keyframe.voices) {
      voice.starts = k % 100 == 0;
      if (voice.starts) voice.delay_frames.fill(-48000.0 * ((37 * k + 11 * voice.slot) % 900));
      voice.start_delay_frames = voice.delay_frames;
    }
    const bool comes = k % 150 < 100;
    if (comes) loader.play(keyframe.voices);
    if (k % 50 == 0) loader.wait(0.05);
    for (int step = 0; step < kKeyframeFrames / kStepFrames; ++step) {
      const Forbidden forbidden;
      if (mixer.wants_keyframe()) {
        loader.mark_quiescent(mixer.clock_frames());
        if (comes)
          mixer.load(keyframe);
        else
          mixer.hold();
      }
      mixer.step(out.data());
      loudest = std::max(loudest, out[0]);
    }
  }
  EXPECT_GT(loudest, 0.1f);
  EXPECT_GT(mixer.late_voices(), 0u);
  EXPECT_GT(loader.statistics().dropped, 0u);
  EXPECT_GT(loader.statistics().failed, 0u);
}

}  // namespace
}  // namespace clamor
