// first_reflection_kernel_test.cpp: the first reflections that reach a threshold, on every
// instruction set, against the priority that each has.
#include "runtime/probes/first_reflection_kernel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/probes/probe_sources.h"
#include "runtime/propagation/source_weight.h"
#include "tests/box_mesh.h"
#include "tests/runtime/instruction_sets.h"

namespace clamor {
namespace {

constexpr std::uint32_t kReflections = 37;

using FirstReflectionKernel = testing::OnInstructionSet;
INSTANTIATE_TEST_SUITE_P(EveryInstructionSet, FirstReflectionKernel,
                         testing::every_instruction_set(), testing::instruction_set_name);

Vec3 within(double extent_m, const RandomBits& bits) {
  return extent_m * Vec3(2 * unit(bits[0]) - 1, 2 * unit(bits[1]) - 1, 2 * unit(bits[2]) - 1);
}

Source random_reflection(std::uint32_t seed, std::uint32_t index, const Vec3& place_m,
                         std::uint16_t material) {
  const RandomBits bits = philox(seed, {0, index, 0, 0});
  const Vec3 leg_m = within(std::exp2(3 * unit(bits[0]) - 1), philox(seed, {1, index, 0, 0}));
  const Vec3 normal = normalize(within(1, philox(seed, {2, index, 0, 0})));
  const Vec3 arriving = normalize(leg_m);
  const double cos_i = dot(arriving, normal);
  Source source;
  source.position_m = Vec3f(place_m + leg_m);
  source.normal = Vec3f(normal);
  source.mirror = Vec3f(cos_i < 0 ? arriving - 2 * cos_i * normal : arriving);
  source.material = material;
  source.u = static_cast<float>(unit_above_zero(bits[1]));
  for (std::uint32_t b = 0; b < kBandCount; ++b)
    source.power[b] = static_cast<float>(unit(philox(seed, {3, index, b, 0})[0]));
  return source;
}

// Reflections traced from a place far from the origin, a source near it and a listener.
struct TracedPlace {
  Vec3 place_m{}, listener_m{};
  MovingRadiator radiator;
  FirstReflectionRows rows;
  std::vector<double> priorities;  // in the order of the rows

  TracedPlace(std::uint32_t seed, const ProbeBounds& bounds, std::uint16_t materials) {
    place_m = Vec3(80, -20, 130) + within(5, philox(seed, {4, 0, 0, 0}));
    listener_m = place_m + within(6, philox(seed, {5, 0, 0, 0}));
    std::vector<Source> stored;
    for (std::uint32_t r = 0; r < kReflections; ++r)
      stored.push_back(
          random_reflection(seed, r, place_m, static_cast<std::uint16_t>(r % materials)));
    // Some sources are on a surface, or nearly.
    const RandomBits bits = philox(seed, {6, 0, 0, 0});
    const bool is_on_surface = seed % 8 == 0;
    const double extent_m = std::exp2(2 * unit(bits[3]) - (is_on_surface ? 7 : 0));
    radiator.position_m =
        (is_on_surface ? Vec3(stored[0].position_m) : place_m) + within(extent_m, bits);
    for (const Source& one : stored) {
      rows.add(bounds, one, place_m);
      const Source moved =
          first_reflection(one, place_m, radiator, bounds.radiation().speed_of_sound_mps());
      priorities.push_back(
          weighted_sum(bounds.weights(), bounds.radiation().intensity(moved, listener_m)) /
          static_cast<double>(one.u));
    }
  }
};

TEST_P(FirstReflectionKernel, FindsEveryReflectionThatReachesTheThresholdAndFewOthers) {
  const std::array materials = {testing::uniform_material(0.1f),
                                testing::uniform_material(0.1f, 0.1f, 20),
                                testing::uniform_material(0.1f, 0, 1000)};
  const ProbeBounds bounds(materials, {}, {});
  std::size_t reached = 0, found = 0;
  CulledPage reaching;
  for (std::uint32_t seed = 0; seed < 3000; ++seed) {
    const TracedPlace scene(seed, bounds, materials.size());
    std::vector<double> sorted = scene.priorities;
    std::sort(sorted.begin(), sorted.end());
    const double threshold = std::max(sorted[kReflections / 2], 1e-12);
    const FirstReflectionQuery query{Vec3f(scene.radiator.position_m - scene.place_m),
                                     Vec3f(scene.listener_m - scene.place_m),
                                     static_cast<float>(threshold)};
    find_reaching_reflections(scene.rows, query, reaching);
    std::vector<float> upper_bounds(kReflections);
    for (std::size_t f = 0; f < reaching.count; ++f)
      upper_bounds[reaching.index[f]] = reaching.upper_bound[f];
    const double of_all = static_cast<double>(scene.rows.upper_bound(query.listener_m));
    for (std::uint32_t r = 0; r < kReflections; ++r) {
      if (scene.priorities[r] < threshold * (1 + 1e-6)) continue;
      ++reached;
      ASSERT_GE(static_cast<double>(upper_bounds[r]), scene.priorities[r] * (1 - 1e-6))
          << seed << " " << r;
      ASSERT_GE(of_all, scene.priorities[r]);
    }
    found += reaching.count;
  }
  EXPECT_GT(reached, 30'000u);
  EXPECT_LT(2 * found, 3 * reached);
}

}  // namespace
}  // namespace clamor
