// probe_decay_test.cpp: late reflections of probes decay as those of an emitter between smooth
// walls.
#include <cmath>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/air.h"
#include "common/reflection.h"
#include "runtime/propagation/received_intensity.h"
#include "tests/rooms.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

constexpr std::size_t kProbeBand = 3;
constexpr double kFrom_s = 0.1, kUntil_s = 0.5;

// Energies around two moments, in a box that hides nothing, mean of places in its middle.
struct LateEnergy {
  double at_first = 0, at_last = 0;
};

double ratio_db(double ratio) { return 10 * std::log10(ratio); }

LateEnergy late_energy(std::span<const Source> sources, std::span<const Material> materials) {
  const std::vector<Emitter> emitters(1);
  const ReflectionLaws laws(materials);
  const Bands loss_per_m = air_loss_per_m(Air{});
  const double speed_mps = speed_of_sound_mps(Air{});
  LateEnergy energy;
  for (const Source& source : sources)
    for (const double x_m : {3.0, 5.0, 7.0})
      for (const double z_m : {2.0, 4.0}) {
        const Vec3 listener_m(x_m, 1.5, z_m);
        const double time_s = static_cast<double>(source.delay_s) +
                              length(listener_m - Vec3(source.position_m)) / speed_mps;
        if (std::abs(time_s - kFrom_s) > 0.025 && std::abs(time_s - kUntil_s) > 0.05) continue;
        const double received = static_cast<double>(
            received_intensity(source, emitters, laws, loss_per_m, listener_m)[kProbeBand]);
        if (std::abs(time_s - kFrom_s) < 0.025) energy.at_first += received;
        if (std::abs(time_s - kUntil_s) < 0.05) energy.at_last += received;
      }
  return energy;
}

// Smooth walls around a floor and a ceiling that absorb much: what is late goes to and fro between
// the walls.
TEST(ProbeDecay, IsThatOfAnEmitterBetweenSmoothWalls) {
  if (testing::kSanitized) GTEST_SKIP() << "only numbers, which a sanitizer does not judge";
  Level level;
  level.mesh = testing::box({10, 3, 6}, {0, 0, 1, 1, 0, 0});
  level.materials = {testing::uniform_material(0.1f, 0.1f, kMirrorExponent),
                     testing::uniform_material(0.5f, 0.1f, kMirrorExponent)};
  level.signals = {testing::sine()};
  level.emitters.emplace_back();
  level.emitters[0].position_m = {4, 1.5, 2.5};
  BakeOptions options;
  options.settings.photons = 40'000;
  options.settings.sources = 100'000;
  options.settings.early_order = 0;
  options.probes_m = {{4, 1.5, 2.5}};
  options.probe_sources = 10'000;
  const auto contents = bake(level, options);
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  const LateEnergy emitter = late_energy(contents->octree.sources, level.materials);
  std::vector<Source> late = contents->probes.zones.at(0).sources;
  for (Source& source : late) source.material = 0;
  const std::vector<Material> diffuse = {diffuse_material("late reflections")};
  const LateEnergy probe = late_energy(late, diffuse);
  // By the cosine law alone they would be 1.1 and 2.1 dB too quiet. The noise is some 0.2 dB.
  EXPECT_NEAR(ratio_db(probe.at_first / emitter.at_first), 0, 0.6);
  EXPECT_NEAR(ratio_db(probe.at_last / emitter.at_last), 0, 0.6);
}

}  // namespace
}  // namespace clamor
