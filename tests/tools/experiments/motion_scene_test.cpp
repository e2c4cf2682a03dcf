// Tests that a track that begins in the middle of a path equals that part of the whole track, and
// that a bake to be measured knows its mirrors.
#include "tools/experiments/motion_scene.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "common/air.h"
#include "runtime/engine/auralizer_input.h"
#include "tests/baked_room.h"
#include "tests/box_mesh.h"
#include "tools/experiments/baked_level.h"

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

// A mirror of 2 m on a floor.
Level floor_and_mirror(const Vec3& emitter_m) {
  Level level;
  testing::add_quad(level.mesh,
                    {Vec3f(-20, 0, -20), Vec3f(20, 0, -20), Vec3f(20, 0, 20), Vec3f(-20, 0, 20)});
  testing::add_quad(level.mesh, {Vec3f(0, 0, 0), Vec3f(0, 2, 0), Vec3f(0, 2, 2), Vec3f(0, 0, 2)});
  level.materials = {testing::uniform_material(0.05f, 0, kMirrorExponent)};
  level.signals = {{"impulse", {1}, false}};
  level.emitters.resize(1);
  level.emitters[0].position_m = emitter_m;
  return level;
}

// The image in the floor and the mirror is heard beside the mirror, over its border, if both are
// known to lead to it.
TEST(BakedEnergies, KnowTheMirrorsOfTheirOwnImages) {
  const Vec3 listener_m(2, 1, 5);
  for (const double z : {1.0, 1.3}) {
    const Level level = floor_and_mirror({2, 1.2, z});
    const auto baked = BakedEnergies::bake_level(level, {.photons = 1000, .sources = 1000});
    ASSERT_TRUE(baked.ok()) << baked.error().message;
    const double time_s =
        length(listener_m - Vec3(-2, -1.2, z)) / speed_of_sound_mps(BakeSettings().air);
    EXPECT_TRUE(std::ranges::any_of(baked->at(listener_m, 0), [&](const Arrival& one) {
      return std::abs(one.time_s - time_s) < 1e-5 && one.energy[0] > 0;
    })) << z;
  }
}

}  // namespace
}  // namespace clamor
