// auralizer_block_sizes_test.cpp: the output is bit-identical for every block size of a device from
// 16 to 2048 frames; the sizes vary, so that blocks begin and end anywhere in a keyframe.
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/hrtf/hrtf.h"
#include "tests/baked_room.h"
#include "tests/sanitized.h"
#include "tests/sound_device.h"

namespace clamor {
namespace {

using testing::SoundDevice;

constexpr int kMin_frames = 16, kMax_frames = 2048;

// Sizes `step` apart; small and large ones alternate.
std::vector<std::size_t> all_sizes(int step) {
  std::vector<std::size_t> sizes;
  for (int low = kMin_frames, high = kMax_frames; low <= high; low += step, high -= step) {
    sizes.push_back(static_cast<std::size_t>(low));
    if (high != low) sizes.push_back(static_cast<std::size_t>(high));
  }
  return sizes;
}

OutputFormat two_ears() {
  OutputFormat shape = *OutputFormat::from_options(true, "", false);
  shape.head = *Hrtf::read("");
  return shape;
}

std::unique_ptr<Auralizer> forty_voices(const OutputFormat& shape) {
  AuralizerOptions options;
  options.voices = 40;  // of about 1500 sources, so voices start and end
  options.output = shape;
  options.limit = true;
  options.gain = 4;
  options.block_frames = 2 * kMax_frames;  // what a device at 24 kHz asks for
  AuralizerInput input = testing::baked_room();
  for (Signal& signal : input.signals) signal.loop = true;
  auto auralizer = Auralizer::create(std::move(input), options);
  EXPECT_TRUE(auralizer.ok());
  return std::move(*auralizer);
}

Listener strolling(double t) {
  return {{3 + 2 * std::sin(t), 4 + 3 * std::cos(t), 1.5}, 0.7 * t, 0};
}

// Compares varied block sizes with blocks of one keyframe.
void expect_the_same(const OutputFormat& shape, int rate_hz, int step) {
  constexpr std::size_t kRegular_frames = 960;
  // The resampler accumulates its position in double precision from block to block.
  const float off = rate_hz == kSampleRate_hz ? 0 : 1e-6f;
  SoundDevice torn(forty_voices(shape), rate_hz, kMax_frames);
  SoundDevice whole(forty_voices(shape), rate_hz, kMax_frames);
  std::vector<float> regular;
  for (const std::size_t frames : all_sizes(step)) {
    torn.make_keyframes(strolling);
    const std::span<const float> block = torn.call(frames);
    while (regular.size() < block.size()) {
      whole.make_keyframes(strolling);
      const std::span<const float> more = whole.call(kRegular_frames);
      regular.insert(regular.end(), more.begin(), more.end());
    }
    for (std::size_t i = 0; i < block.size(); ++i)
      ASSERT_NEAR(block[i], regular[i], off) << "sample " << i << " of a block of " << frames;
    regular.erase(regular.begin(), regular.begin() + static_cast<std::ptrdiff_t>(block.size()));
  }
  EXPECT_GT(torn.energy(), 1);
  EXPECT_EQ(torn.statistics().held_blocks, 0u);
  EXPECT_EQ(whole.statistics().held_blocks, 0u);
  EXPECT_GT(torn.statistics().limited.frames, 0u);
}

// The walk takes 44 s.
TEST(AuralizerBlockSizes, DoNotChangeStereoOutput) {
  expect_the_same({}, kSampleRate_hz, testing::kSanitized ? 97 : 1);
}

TEST(AuralizerBlockSizes, DoNotChangeBinauralOutput) {
  expect_the_same(two_ears(), kSampleRate_hz, testing::kSanitized ? 331 : 23);
}

TEST(AuralizerBlockSizes, DoNotChangeLoudspeakerOutput) {
  expect_the_same(*OutputFormat::from_options(false, "7.1.4", false), kSampleRate_hz,
                  testing::kSanitized ? 331 : 23);
}

TEST(AuralizerBlockSizes, DoNotChangeOutputAtAnotherSampleRate_NoAsan) {
  for (const int rate_hz : {32000, 44100, 96000})
    expect_the_same({}, rate_hz, testing::kSanitized ? 331 : 41);
}

}  // namespace
}  // namespace clamor
