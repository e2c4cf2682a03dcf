// Tests that a track that begins in the middle of a path equals that part of the whole track.
#include "tools/experiments/motion_scene.h"

#include <cmath>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer_input.h"
#include "tests/baked_room.h"

namespace clamor {
namespace {

// A tone of varying level, so that moments differ.
AuralizerInput swelling_room() {
  AuralizerInput input = testing::baked_room();
  for (Signal& signal : input.signals) {
    signal.samples.resize(kSampleRate_hz);
    signal.loop = true;
    for (std::size_t f = 0; f < signal.samples.size(); ++f) {
      const double t = static_cast<double>(f) / kSampleRate_hz;
      signal.samples[f] = static_cast<float>(0.1 * (1 + std::sin(5 * t)) * std::sin(2000 * t));
    }
  }
  return input;
}

TEST(Motion, BeginsAnywhereOnTheWayWithWhatIsHeardThere) {
  const MotionScene scene(swelling_room());
  const ListenerPath path(swelling_room().sources, {3, 4, 1.5});
  constexpr std::size_t kFirst = 30, kKeyframes = 10;
  for (const char* strategy : {"all", "priority"}) {
    SCOPED_TRACE(strategy);
    const auto from = [&](std::uint64_t first, std::size_t keyframes) {
      return render_segment(scene, path, 1.5, strategy, 1'000'000, first, keyframes);
    };
    const RenderedSegment whole = from(0, kFirst + kKeyframes), part = from(kFirst, kKeyframes);
    ASSERT_EQ(part.powers.size(), kKeyframes);
    for (std::size_t k = 0; k < kKeyframes; ++k)
      EXPECT_NEAR(10 * std::log10(part.powers[k] / whole.powers[kFirst + k]), 0, 0.01) << k;
    double power = 0, off = 0;
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t f = 0; f < kKeyframes * kKeyframeFrames; ++f) {
        const double right = whole.sound.channels[e][kFirst * kKeyframeFrames + f];
        power += right * right;
        off += std::pow(static_cast<double>(part.sound.channels[e][f]) - right, 2);
      }
    ASSERT_GT(power, 0);
    EXPECT_LT(10 * std::log10(off / power), -50);
  }
}

}  // namespace
}  // namespace clamor
