// copy_kernel_test.cpp: the copies of a first reflection that reach a threshold, on every
// instruction set, against the priority that each copy has.
#include "runtime/probes/copy_kernel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/probes/probe_sources.h"
#include "runtime/propagation/source_weight.h"
#include "tests/rooms.h"
#include "tests/runtime/instruction_sets.h"

namespace clamor {
namespace {

constexpr std::uint32_t kCopies = 61;

using CopyKernel = testing::OnInstructionSet;
INSTANTIATE_TEST_SUITE_P(EveryInstructionSet, CopyKernel, testing::every_instruction_set(),
                         testing::instruction_set_name);

Vec3 within(double extent_m, const RandomBits& bits) {
  return extent_m * Vec3(2 * unit(bits[0]) - 1, 2 * unit(bits[1]) - 1, 2 * unit(bits[2]) - 1);
}

// A reflection far from the origin, its probe, its copies and a listener.
struct CopiedReflection {
  Source stored;
  Vec3 probe_m{}, listener_m{};
  std::vector<MovingRadiator> radiators;
  CopyRows rows;
  std::vector<double> priorities;  // of the copies, in the order of the rows

  CopiedReflection(std::uint32_t seed, const ProbeBounds& bounds, std::uint16_t material) {
    const RandomBits bits = philox(seed, {0, 0, 0, 0});
    probe_m = Vec3(80, -20, 130) + within(5, philox(seed, {1, 0, 0, 0}));
    const Vec3 leg_m = within(std::exp2(3 * unit(bits[0]) - 1), philox(seed, {2, 0, 0, 0}));
    stored.position_m = Vec3f(probe_m + leg_m);
    const Vec3 normal = normalize(within(1, philox(seed, {3, 0, 0, 0})));
    stored.normal = Vec3f(normal);
    const Vec3 arriving = normalize(leg_m);
    const double cos_i = dot(arriving, normal);
    stored.mirror = Vec3f(cos_i < 0 ? arriving - 2 * cos_i * normal : arriving);
    stored.material = material;
    stored.emitter = kOnFirstSurface;
    stored.u = static_cast<float>(unit_above_zero(bits[1]));
    for (std::uint32_t b = 0; b < kBandCount; ++b)
      stored.power[b] = static_cast<float>(unit(philox(seed, {4, b, 0, 0})[0]));
    listener_m = probe_m + within(6, philox(seed, {5, 0, 0, 0}));
    for (std::uint32_t c = 0; c < kCopies; ++c) {
      const RandomBits of_copy = philox(seed, {6, c, 0, 0});
      MovingRadiator radiator;
      // Some are on the surface, or nearly.
      const double extent_m = std::exp2(2 * unit(of_copy[3]) - (c % 8 == 0 ? 7 : 0));
      radiator.position_m =
          (c % 8 == 0 ? Vec3(stored.position_m) : probe_m) + within(extent_m, of_copy);
      radiators.push_back(radiator);
    }
    for (std::uint32_t c = 0; c < kCopies; ++c) {
      const float factor = std::exp2(-static_cast<float>(c) / 16);
      rows.add(radiators[c].position_m - probe_m, factor);
      Source source =
          early_reflection(stored, probe_m, radiators[c], bounds.radiation().speed_of_sound_mps());
      source.emitter = 0;
      priorities.push_back(
          weighted_sum(bounds.weights(), bounds.radiation().intensity(source, listener_m)) *
          static_cast<double>(factor / stored.u));
    }
    rows.pad();
  }
};

TEST_P(CopyKernel, FindsEveryCopyThatReachesTheThresholdAndFewOthers) {
  const std::array materials = {testing::uniform_material(0.1f),
                                testing::uniform_material(0.1f, 0.1f, 20),
                                testing::uniform_material(0.1f, 0, 1000)};
  const ProbeBounds bounds(materials, {}, {});
  std::size_t reached = 0, found = 0;
  for (std::uint32_t seed = 0; seed < 3000; ++seed) {
    const CopiedReflection scene(seed, bounds, static_cast<std::uint16_t>(seed % materials.size()));
    const std::array stored = {scene.stored};
    FirstReflection reflection;
    reflection.bound = bounds.first_reflections(stored, false)[0];
    reflection.bound.position_m = Vec3f(Vec3(scene.stored.position_m) - scene.probe_m);
    reflection.listener_m = Vec3f(scene.listener_m - scene.probe_m);
    reflection.irradiance_of_probe =
        static_cast<float>(irradiance_of_probe(scene.stored, scene.probe_m));
    std::vector<double> sorted = scene.priorities;
    std::sort(sorted.begin(), sorted.end());
    const double threshold = std::max(sorted[kCopies / 2], 1e-12);
    reflection.threshold = static_cast<float>(threshold);
    ReachingCopies reaching;
    find_reaching_copies(reflection, scene.rows, 0, kCopies, reaching);
    std::vector<float> upper_bounds(kCopies);
    for (std::size_t f = 0; f < reaching.count; ++f)
      upper_bounds[reaching.index[f]] = reaching.upper_bound[f];
    for (std::uint32_t c = 0; c < kCopies; ++c) {
      if (scene.priorities[c] < threshold * (1 + 1e-6)) continue;
      ++reached;
      ASSERT_GE(static_cast<double>(upper_bounds[c]), scene.priorities[c] * (1 - 1e-6))
          << seed << " " << c;
    }
    found += reaching.count;
  }
  EXPECT_GT(reached, 40'000u);
  EXPECT_LT(2 * found, 3 * reached);
}

}  // namespace
}  // namespace clamor
