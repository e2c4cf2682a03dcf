// source_page_test.cpp: sources that are not culled, on every instruction set.
#include "runtime/propagation/source_page.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "common/air.h"
#include "runtime/propagation/source_weight.h"
#include "tests/runtime/instruction_sets.h"
#include "tests/runtime/scattered_sources.h"
#include "tests/runtime/source_bound_reference.h"

namespace clamor {
namespace {

// Among the sources, beside them, far away, and on top of one.
Vec3 somewhere(const testing::ScatteredSources& level, double spread_m, const Vec3& middle_m,
               std::uint32_t i) {
  if (i % 5 == 0) return Vec3(level.sources[i % level.sources.size()].position_m);
  const RandomBits bits = philox(77, {i, 0, 0, 0});
  return middle_m + spread_m * std::pow(10, 2 * unit(bits[3]) - 1) * testing::direction(bits);
}

using SourcePageOn = testing::OnInstructionSet;
INSTANTIATE_TEST_SUITE_P(EveryInstructionSet, SourcePageOn, testing::every_instruction_set(),
                         testing::instruction_set_name);

TEST_P(SourcePageOn, PassesEverySourceAboveTheThresholdAndFewOthers) {
  struct Place {
    double spread_m;
    Vec3 middle_m;
  };
  for (const Place& where : {Place{10, {0, 0, 0}}, Place{0.01, {5, 6, 7}},
                             Place{300, {-8000, 20, 9000}}, Place{20'000, {0, 0, 0}}})
    for (const std::uint32_t count : {1u, 17u, 300u, 512u}) {
      const testing::ScatteredSources level(count, count, where.spread_m, where.middle_m);
      const RadiationModel radiation(level.emitters, level.materials, Air{});
      const auto sources = level.bounds(radiation);
      const SourcePage page(radiation, {{level.weight}}, level.sources);
      std::size_t through = 0, by_the_formula = 0;
      for (std::uint32_t i = 0; i < 30; ++i) {
        const Vec3 place = somewhere(level, where.spread_m, where.middle_m, i);
        std::vector<double> ceilings;
        for (const SourceBound& source : sources)
          ceilings.push_back(testing::priority_upper_bound(source, place));
        std::vector<double> sorted = ceilings;
        std::sort(sorted.begin(), sorted.end());
        for (const double threshold : {0.0, sorted[count / 2], sorted[count - 1 - count / 16]}) {
          CulledPage culled;
          page.cull(place, 0, threshold, culled);
          std::vector<double> found(count, -1);
          for (std::size_t c = 0; c < culled.count; ++c) {
            ASSERT_LT(culled.index[c], count);
            found[culled.index[c]] = static_cast<double>(culled.upper_bound[c]);
            ++through;
          }
          for (std::uint32_t s = 0; s < count; ++s) {
            const Source& source = level.sources[s];
            const double priority =
                weight(radiation, level.weight, source, place) / std::max(source.u, kMinU);
            ASSERT_LE(priority, ceilings[s] * (1 + 1e-6));
            if (found[s] >= 0)
              ASSERT_GE(found[s], ceilings[s]);
            else
              ASSERT_TRUE(ceilings[s] < threshold || ceilings[s] == 0) << s;
            by_the_formula += ceilings[s] >= threshold;
          }
        }
      }
      // With sources tens of kilometres apart, single precision is off by a few millimetres.
      EXPECT_LT(static_cast<double>(through), 1.02 * static_cast<double>(by_the_formula) + 30);
    }
}

// A validity radius asks which sources may reach the threshold within a ball.
TEST_P(SourcePageOn, BoundsPrioritiesWithinAWholeBall) {
  const testing::ScatteredSources level(5, 512, 10, {3, 2, 1});
  const RadiationModel radiation(level.emitters, level.materials, Air{});
  const auto sources = level.bounds(radiation);
  const SourcePage page(radiation, {{level.weight}}, level.sources);
  std::size_t passed = 0, reached = 0;
  for (std::uint32_t i = 0; i < 60; ++i) {
    const Vec3 middle = somewhere(level, 10, {3, 2, 1}, i);
    const RandomBits bits = philox(78, {i, 0, 0, 0});
    const double radius_m = std::pow(10, -2 * unit(bits[0]));
    const double threshold = testing::priority_upper_bound(sources[bits[2] % 512], middle) + 1e-9;
    CulledPage culled;
    page.cull(middle, radius_m, threshold, culled);
    std::vector<double> found(512, 0);
    for (std::size_t c = 0; c < culled.count; ++c)
      found[culled.index[c]] = static_cast<double>(culled.upper_bound[c]);
    passed += static_cast<std::size_t>(std::count_if(
        found.begin(), found.end(), [](double upper_bound) { return upper_bound > 0; }));
    // Samples the surface of the ball and its interior; priorities must not exceed the bound.
    for (std::uint32_t k = 0; k < 40; ++k) {
      const RandomBits step = philox(79, {i, k, 0, 0});
      const Vec3 place =
          middle + radius_m * (k % 2 == 0 ? 1.0 : unit(step[3])) * testing::direction(step);
      for (std::size_t s = 0; s < 512; ++s) {
        const double upper_bound = testing::priority_upper_bound(sources[s], place);
        if (upper_bound < threshold) continue;
        ++reached;
        ASSERT_GE(found[s], upper_bound * (1 - 1e-6)) << i << " " << k << " " << s;
      }
    }
  }
  EXPECT_GT(reached, 10'000u);
  EXPECT_LT(passed, 60u * 512u);
}

// Largest upper bound in a ball outside the source, assuming that the nearest point, the point
// closest to the lobe's axis and the point closest to the normal coincide.
double highest_in_ball(const SourceBound& s, const Vec3& middle, double radius_m) {
  const Vec3 offset_m = middle - Vec3(s.position_m);
  const double r_m = length(offset_m), turn = std::asin(radius_m / r_m);
  const auto turned = [&](const Vec3f& to) {
    const double angle = std::acos(std::clamp(dot(offset_m, Vec3(to)) / r_m, -1.0, 1.0));
    return std::cos(std::max(0.0, angle - turn));
  };
  const double near_m = std::max<double>(r_m - radius_m, std::sqrt(s.radius2_m2));
  const double lobe = s.lobe * std::exp(-s.fall * (1 - turned(s.mirror)));
  if (s.slope < 0) return lobe / (near_m * near_m);  // an emitter
  const double cos_o = std::max(turned(s.normal), 0.0);
  const double cos_i = std::max<double>(dot(s.mirror, s.normal), 1e-9);
  const double x = std::min(cos_o, 1 / std::max<double>(s.slope, 1e-9));
  const double even = s.diffuse * cos_o + s.compensation * x * std::exp(-s.slope * x);
  return (even + lobe * std::min(1.0, cos_o / cos_i)) / (near_m * near_m);
}

// Loose bounds would triple the number of sources that the runtime tests.
TEST_P(SourcePageOn, HasTightBoundsForABall) {
  const testing::ScatteredSources level(6, 512, 1, {0, 0, 0});
  const RadiationModel radiation(level.emitters, level.materials, Air{});
  const auto sources = level.bounds(radiation);
  const SourcePage page(radiation, {{level.weight}}, level.sources);
  std::size_t compared = 0, sharp = 0;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const RandomBits bits = philox(80, {i, 0, 0, 0});
    const double away_m = 20, radius_m = unit(bits[3]);
    const Vec3 middle = away_m * testing::direction(bits);
    CulledPage culled;
    page.cull(middle, radius_m, 1e-12, culled);
    for (std::size_t c = 0; c < culled.count; ++c) {
      const std::uint32_t s = culled.index[c];
      const auto upper_bound = static_cast<double>(culled.upper_bound[c]);
      const double highest = highest_in_ball(sources[s], middle, radius_m);
      const double in_front =
          testing::priority_upper_bound(sources[s], Vec3(sources[s].position_m));
      if (highest < 1e-9 * in_front) continue;  // nothing remains to compare
      // Single precision rotates the sharpest lobes, of exponent 1000, a little.
      ASSERT_LE(upper_bound, 1.02 * highest) << i << " " << s;
      ++compared;
      sharp += sources[s].fall > 50;
    }
  }
  EXPECT_GT(compared, 5000u);
  EXPECT_GT(sharp, 100u);
}

TEST_P(SourcePageOn, EqualsTheBoundInDoublePrecision) {
  const testing::ScatteredSources level(3, 512, 10, {1, 2, 3});
  const RadiationModel radiation(level.emitters, level.materials, Air{});
  const auto sources = level.bounds(radiation);
  const SourcePage page(radiation, {{level.weight}}, level.sources);
  std::size_t compared = 0;
  for (std::uint32_t i = 0; i < 40; ++i) {
    // Not on a source, where half a centimetre changes the direction.
    const Vec3 place =
        Vec3(1, 2, 3) + (i % 2 == 0 ? 20.0 : 7.0) * testing::direction(philox(9, {i, 0, 0, 0}));
    CulledPage culled;
    page.cull(place, 0, 1e-12, culled);
    for (std::size_t c = 0; c < culled.count; ++c) {
      const std::uint32_t s = culled.index[c];
      const auto upper_bound = static_cast<double>(culled.upper_bound[c]);
      const double expected = testing::priority_upper_bound(sources[s], place);
      // At the horizon or far from the axis of a narrow lobe, nothing remains to compare.
      if (expected < 1e-9 * testing::priority_upper_bound(sources[s], Vec3(sources[s].position_m)))
        continue;
      ASSERT_GE(upper_bound, expected);
      ASSERT_LE(upper_bound, expected * testing::kMaxBoundExcess + 1e-5) << s;
      ++compared;
    }
  }
  EXPECT_GT(compared, 5000u);
}

TEST(SourcePage, FindsTheSameInListsOfAnyLength) {
  for (const std::uint32_t count : {0u, 1u, 511u, 512u, 513u, 5000u}) {
    const testing::ScatteredSources level(7, std::max(count, 1u), 10, {0, 0, 0});
    const RadiationModel radiation(level.emitters, level.materials, Air{});
    const std::vector<Bands> weights(1, level.weight);
    std::vector<Source> sources = level.sources;
    sources.resize(count);
    const SourcePage page(radiation, weights, sources);
    const Vec3 place(2, 1, 0);
    std::vector<bool> found(count, false);
    CulledPage culled;
    page.cull(place, 0, 1, culled);
    for (std::size_t c = 0; c < culled.count; ++c) found[culled.index[c]] = true;
    for (std::uint32_t i = 0; i < count; ++i)
      EXPECT_TRUE(found[i] || weight(radiation, level.weight, sources[i], place) / sources[i].u < 1)
          << i;
  }
}

}  // namespace
}  // namespace clamor
