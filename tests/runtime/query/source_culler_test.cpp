// source_culler_test.cpp: sources that the culler passes, on every instruction set.
#include "runtime/query/source_culler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "common/air.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/query/shortlist_kernel.h"
#include "runtime/query/source_page.h"
#include "runtime/sampling/sampler.h"
#include "tests/runtime/instruction_sets.h"
#include "tests/runtime/scattered_sources.h"

namespace clamor {
namespace {

// Among the sources, beside them, far away, and on top of one.
Vec3 somewhere(const testing::ScatteredSources& level, double spread_m, const Vec3& middle_m,
               std::uint32_t i) {
  if (i % 5 == 0) return Vec3(level.sources[i % level.sources.size()].position_m);
  const RandomBits bits = philox(77, {i, 0, 0, 0});
  return middle_m + spread_m * std::pow(10, 2 * unit(bits[3]) - 1) * testing::direction(bits);
}

using SourceCullerOn = testing::OnInstructionSet;
INSTANTIATE_TEST_SUITE_P(EveryInstructionSet, SourceCullerOn, testing::every_instruction_set(),
                         testing::instruction_set_name);

TEST_P(SourceCullerOn, PassesEverySourceAboveTheThresholdAndFewOthers) {
  struct Place {
    double spread_m;
    Vec3 middle_m;
  };
  for (const Place& where : {Place{10, {0, 0, 0}}, Place{0.01, {5, 6, 7}},
                             Place{300, {-8000, 20, 9000}}, Place{20'000, {0, 0, 0}}})
    for (const std::uint32_t count : {1u, 17u, 300u, 512u}) {
      const testing::ScatteredSources level(count, count, where.spread_m, where.middle_m);
      const RadiationModel radiation(level.emitters, level.materials, Air{});
      const auto sources = level.cull_sources(radiation);
      const SourceCuller culler(sources);
      std::size_t through = 0, by_the_formula = 0;
      for (std::uint32_t i = 0; i < 30; ++i) {
        const Vec3 place = somewhere(level, where.spread_m, where.middle_m, i);
        std::vector<double> ceilings;
        for (const CullSource& source : sources)
          ceilings.push_back(priority_upper_bound(source, place));
        std::vector<double> sorted = ceilings;
        std::sort(sorted.begin(), sorted.end());
        for (const double threshold : {0.0, sorted[count / 2], sorted[count - 1 - count / 16]}) {
          CullResult result;
          culler.cull(place, threshold, result);
          std::vector<double> found(count, -1);
          result.for_each([&](std::size_t s, double upper_bound) {
            ASSERT_LT(s, count);
            found[s] = upper_bound;
            ++through;
          });
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
TEST_P(SourceCullerOn, BoundsPrioritiesWithinAWholeBall) {
  const testing::ScatteredSources level(5, 512, 10, {3, 2, 1});
  const RadiationModel radiation(level.emitters, level.materials, Air{});
  const auto sources = level.cull_sources(radiation);
  const SourceCuller culler(sources);
  std::size_t passed = 0, reached = 0;
  for (std::uint32_t i = 0; i < 60; ++i) {
    const Vec3 middle = somewhere(level, 10, {3, 2, 1}, i);
    const RandomBits bits = philox(78, {i, 0, 0, 0});
    const CullMargin margin{std::pow(10, -2 * unit(bits[0])), std::pow(10, 2 * unit(bits[1]) - 1)};
    const double threshold = priority_upper_bound(sources[bits[2] % 512], middle) + 1e-9;
    CullResult result;
    culler.cull(middle, threshold, result, margin);
    std::vector<double> found(512, 0);
    result.for_each([&](std::size_t s, double upper_bound) { found[s] = upper_bound; });
    passed += static_cast<std::size_t>(std::count_if(
        found.begin(), found.end(), [](double upper_bound) { return upper_bound > 0; }));
    // Samples the surface of the ball and its interior; priorities must not exceed the bound.
    for (std::uint32_t k = 0; k < 40; ++k) {
      const RandomBits step = philox(79, {i, k, 0, 0});
      const Vec3 place =
          middle + margin.radius_m * (k % 2 == 0 ? 1.0 : unit(step[3])) * testing::direction(step);
      for (std::size_t s = 0; s < 512; ++s) {
        const double upper_bound = priority_upper_bound(sources[s], place);
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
double highest_in_ball(const CullSource& s, const Vec3& middle, double radius_m) {
  const Vec3 offset_m = middle - Vec3(s.position_m);
  const double r_m = length(offset_m), turn = std::asin(radius_m / r_m);
  const auto turned = [&](const Vec3f& to) {
    const double angle = std::acos(std::clamp(dot(offset_m, Vec3(to)) / r_m, -1.0, 1.0));
    return std::cos(std::max(0.0, angle - turn));
  };
  const double near_m = std::max<double>(r_m - radius_m, s.radius_m);
  const double lobe = s.lobe * std::exp(-s.fall * (1 - turned(s.mirror)));
  if (s.is_emitter) return lobe / (near_m * near_m);
  const double cos_o = std::max(turned(s.normal), 0.0);
  const double cos_i = std::max<double>(dot(s.mirror, s.normal), 1e-9);
  const double x = std::min(cos_o, 1 / std::max<double>(s.slope, 1e-9));
  const double even = s.diffuse * cos_o + s.bounce * x * std::exp(-s.slope * x);
  return (even + lobe * std::min(1.0, cos_o / cos_i)) / (near_m * near_m);
}

// Loose bounds would triple the number of sources that the runtime tests.
TEST_P(SourceCullerOn, HasTightBoundsForABall) {
  const testing::ScatteredSources level(6, 512, 1, {0, 0, 0});
  const RadiationModel radiation(level.emitters, level.materials, Air{});
  const auto sources = level.cull_sources(radiation);
  const SourceCuller culler(sources);
  std::size_t compared = 0, sharp = 0;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const RandomBits bits = philox(80, {i, 0, 0, 0});
    const double away_m = 20, radius_m = unit(bits[3]);
    const Vec3 middle = away_m * testing::direction(bits);
    CullResult result;
    culler.cull(middle, 1e-12, result, {radius_m, away_m});
    result.for_each([&](std::size_t s, double upper_bound) {
      const double highest = highest_in_ball(sources[s], middle, radius_m);
      const double in_front = priority_upper_bound(sources[s], Vec3(sources[s].position_m));
      if (highest < 1e-9 * in_front) return;  // nothing remains to compare
      // Single precision rotates the sharpest lobes, of exponent 1000, a little.
      ASSERT_LE(upper_bound, 1.02 * highest) << i << " " << s;
      ++compared;
      sharp += sources[s].fall > 50;
    });
  }
  EXPECT_GT(compared, 5000u);
  EXPECT_GT(sharp, 100u);
}

// The source relative to the listener, as in a shortlist.
SourceShape shape_of(const CullSource& source, const Vec3& place) {
  return {Vec3f(Vec3(source.position_m) - place),
          source.normal,
          source.mirror,
          source.radius_m * source.radius_m,
          source.diffuse,
          source.bounce,
          source.lobe,
          source.fall,
          source.is_emitter ? -1 : source.slope};
}

// Shortlists evaluate the bounds of any number of sources at once.
TEST_P(SourceCullerOn, GivesTheSameBoundsToSourcesOfAShortlist) {
  const testing::ScatteredSources level(8, 300, 10, {1, 2, 3});
  const RadiationModel radiation(level.emitters, level.materials, Air{});
  const auto sources = level.cull_sources(radiation);
  for (const std::uint32_t count : {1u, 15u, 16u, 17u, 300u}) {
    const Vec3 place = Vec3(1, 2, 3) + 12.0 * testing::direction(philox(10, {count, 0, 0, 0}));
    std::vector<SourceShape> shapes(count);
    for (std::size_t s = 0; s < count; ++s) shapes[s] = shape_of(sources[s], place);
    std::vector<float> ceilings(count + 1, -1);
    upper_bounds_at(shapes, 0, ceilings.data());
    for (std::size_t s = 0; s < count; ++s) {
      const double expected = priority_upper_bound(sources[s], place);
      const double in_front = priority_upper_bound(sources[s], Vec3(sources[s].position_m));
      EXPECT_GE(ceilings[s], expected * (1 - 1e-6)) << s;
      EXPECT_LE(ceilings[s], expected * kCullSlack * 1.01 + 1e-7 * in_front) << s;
    }
    EXPECT_EQ(ceilings[count], -1) << "no value beyond the list may be written";
  }
}

// The bounds allow for sources that are displaced by up to `off_m`, like those of instances far
// from the origin in single precision, and for a listener who walks on.
TEST_P(SourceCullerOn, BoundsSourcesOfAShortlistThatAreDisplaced) {
  const testing::ScatteredSources level(11, 400, 1, {0, 0, 0});
  const RadiationModel radiation(level.emitters, level.materials, Air{});
  const auto sources = level.cull_sources(radiation);
  std::vector<SourceShape> shapes(sources.size());
  std::vector<float> ceilings(sources.size());
  std::size_t close = 0;
  for (const float off_m : {1e-6f, 2e-3f, 0.04f})
    for (std::uint32_t i = 0; i < 100; ++i) {
      const Vec3 place = somewhere(level, 1, {0, 0, 0}, i);
      std::vector<Vec3> at;
      for (std::uint32_t s = 0; s < shapes.size(); ++s) {
        const CullSource& source = sources[s];
        at.push_back(Vec3(source.position_m) +
                     0.99 * off_m * testing::direction(philox(12, {i, s, 0, 0})));
        shapes[s] = shape_of(source, place);
      }
      upper_bounds_at(shapes, off_m, ceilings.data());
      for (std::size_t s = 0; s < shapes.size(); ++s) {
        CullSource there = sources[s];
        const double expected =
            priority_upper_bound(there, place - (at[s] - Vec3(there.position_m)));
        ASSERT_GE(ceilings[s], expected * (1 - 1e-6)) << off_m << " " << i << " " << s;
        close += ceilings[s] < 1.1 * expected;
      }
    }
  EXPECT_GT(close, 20'000u);
}

TEST_P(SourceCullerOn, EqualsTheBoundInDoublePrecision) {
  const testing::ScatteredSources level(3, 512, 10, {1, 2, 3});
  const RadiationModel radiation(level.emitters, level.materials, Air{});
  const auto sources = level.cull_sources(radiation);
  const SourceCuller culler(sources);
  std::size_t compared = 0;
  for (std::uint32_t i = 0; i < 40; ++i) {
    // The place is not on a source, where half a centimetre changes the direction.
    const Vec3 place =
        Vec3(1, 2, 3) + (i % 2 == 0 ? 20.0 : 7.0) * testing::direction(philox(9, {i, 0, 0, 0}));
    CullResult result;
    culler.cull(place, 1e-12, result);
    result.for_each([&](std::size_t s, double upper_bound) {
      const double expected = priority_upper_bound(sources[s], place);
      // At the horizon or far from the axis of a narrow lobe, nothing remains to compare.
      if (expected < 1e-9 * priority_upper_bound(sources[s], Vec3(sources[s].position_m))) return;
      ASSERT_GE(upper_bound, expected);
      ASSERT_LE(upper_bound, expected * kCullSlack + 1e-5) << s;
      ++compared;
    });
  }
  EXPECT_GT(compared, 5000u);
}

}  // namespace
}  // namespace clamor
