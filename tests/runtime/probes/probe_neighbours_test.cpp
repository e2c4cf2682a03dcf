#include "runtime/probes/probe_neighbours.h"

#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

std::vector<Vec3> grid() {
  std::vector<Vec3> places_m;
  for (int x = 0; x < 6; ++x)
    for (int z = 0; z < 6; ++z) places_m.push_back({2.0 * x, 1.5, 2.0 * z});
  return places_m;
}

std::map<std::uint32_t, double> as_map(std::span<const ProbeWeight> weights) {
  std::map<std::uint32_t, double> map;
  for (const ProbeWeight& weight : weights) map[weight.probe] = weight.weight;
  return map;
}

TEST(ProbeNeighbours, HaveWeightsThatSumToOneAndChangeSmoothly) {
  ProbeNeighbours neighbours(grid(), nullptr, 1);
  std::map<std::uint32_t, double> last;
  for (int step = 0; step < 8000; ++step) {
    const Vec3 place_m(1 + 0.001 * step, 1.4, 5 + 0.8 * std::sin(0.002 * step));
    neighbours.begin();
    const auto now = as_map(neighbours.weights(0, 1, place_m));
    ASSERT_LE(now.size(), kMaxCopies);
    double sum = 0, change = 0;
    for (const auto& [probe, weight] : now) {
      sum += weight;
      change += std::abs(weight - (last.contains(probe) ? last.at(probe) : 0));
    }
    EXPECT_NEAR(sum, 1, 1e-5);
    // A few millimetres of 2 m: a tenth of a decibel at most.
    if (step > 0) {
      EXPECT_LT(change, 0.025) << step;
    }
    last = now;
  }
}

// The source's weights at a place where it has always been.
std::map<std::uint32_t, double> settled_at(const Vec3& place_m) {
  ProbeNeighbours neighbours(grid(), nullptr, 1);
  neighbours.begin();
  return as_map(neighbours.weights(0, 1, place_m));
}

// The weight that goes from some probes to others.
double moved_between(const std::map<std::uint32_t, double>& a,
                     const std::map<std::uint32_t, double>& b) {
  double moved = 0;
  for (const auto& [probe, weight] : b)
    moved += std::max(0.0, weight - (a.contains(probe) ? a.at(probe) : 0));
  return moved;
}

// At 15 % of the way per keyframe, what is to be moved, at most all, falls by that: probes that the
// source leaves lose 0.7 dB. Weights below 0.2 % are dropped, from 12 probes at most.
TEST(ProbeNeighbours, ChangeByAtMostASixthPerKeyframeHoweverFastTheSourceIs) {
  for (const double speed_mps : {1.5, 15.0, 30.0}) {
    ProbeNeighbours neighbours(grid(), nullptr, 1);
    std::map<std::uint32_t, double> last;
    double largest = 0;
    for (double x_m = -20; x_m < 30; x_m += 0.02 * speed_mps) {
      neighbours.begin();
      const auto now = as_map(neighbours.weights(0, 1, {x_m, 1.4, 4.3}));
      double sum = 0;
      for (const auto& [probe, weight] : now) sum += weight;
      ASSERT_NEAR(sum, 1, 1e-5);
      ASSERT_LE(now.size(), kMaxCopies);
      if (!last.empty()) largest = std::max(largest, moved_between(last, now));
      for (const auto& [probe, weight] : last) {
        if (weight < 0.05) continue;
        EXPECT_GT(now.contains(probe) ? now.at(probe) : 0, 0.84 * weight)
            << speed_mps << " " << x_m;
      }
      last = now;
    }
    EXPECT_LT(largest, 0.15 + 12 * 0.002) << speed_mps;
    EXPECT_GT(largest, 0.01) << speed_mps;
  }
}

// Weights that go 15 % of the way per keyframe are 0.85 / 0.15 keyframes late, in the long run.
TEST(ProbeNeighbours, LagBehindAFlyingSourceByATenthOfASecond) {
  std::vector<Vec3> row;
  for (int x = 0; x < 200; ++x) row.push_back({0.5 * x, 1.5, 0});
  for (const double speed_mps : {1.5, 15.0, 30.0}) {
    ProbeNeighbours neighbours(row, nullptr, 1);
    double lag_m = 0;
    int steps = 0;
    for (double x_m = 5; x_m < 95; x_m += 0.02 * speed_mps) {
      neighbours.begin();
      double centre_m = 0;
      for (const auto& [probe, weight] : as_map(neighbours.weights(0, 1, {x_m, 1.5, 0.3})))
        centre_m += weight * row[probe].x;
      if (x_m < 50) continue;
      lag_m += x_m - centre_m;
      ++steps;
    }
    const double expected_s = 0.02 * 0.85 / 0.15;
    // Eight probes are too few for all that a flying source was near to.
    EXPECT_NEAR(lag_m / steps / speed_mps, expected_s, 0.2 * expected_s) << speed_mps;
  }
}

TEST(ProbeNeighbours, ArriveWhereTheSourceStops) {
  ProbeNeighbours neighbours(grid(), nullptr, 1);
  for (double x_m = 0; x_m < 9; x_m += 0.6) {
    neighbours.begin();
    neighbours.weights(0, 1, {x_m, 1.4, 4.3});
  }
  const Vec3 stop_m(9, 1.4, 4.3);
  int keyframes = 0;
  do {
    neighbours.begin();
    neighbours.weights(0, 1, stop_m);
  } while (!neighbours.is_settled() && ++keyframes < 100);
  EXPECT_EQ(as_map(neighbours.weights(0, 1, stop_m)), settled_at(stop_m));
  // 0.85^39 = 0.0018
  EXPECT_LT(keyframes, 40);
}

TEST(ProbeNeighbours, AreNewForASourceThatLeaps) {
  ProbeNeighbours neighbours(grid(), nullptr, 1);
  neighbours.begin();
  neighbours.weights(0, 1, {0.5, 1.4, 0.3});
  const Vec3 far_m(9, 1.4, 8.3);
  EXPECT_EQ(as_map(neighbours.weights(0, 1, far_m)), settled_at(far_m));
}

TEST(ProbeNeighbours, AreThoseOfTheSourcesOwnRoom) {
  Mesh wall;
  testing::add_quad(wall,
                    {Vec3f(5, -10, -10), Vec3f(5, 10, -10), Vec3f(5, 10, 20), Vec3f(5, -10, 20)});
  const std::vector<Material> materials{testing::uniform_material(0.1f)};
  const OcclusionGeometry surfaces(wall, materials);
  ProbeNeighbours neighbours(grid(), &surfaces, 1);
  neighbours.begin();
  for (const auto& [probe, weight] : as_map(neighbours.weights(0, 1, {4.9, 1.5, 5})))
    EXPECT_LT(grid()[probe].x, 5) << weight;
  // Through the wall: the old room fades out. Weights below 0.2 % are dropped.
  const auto in_old_room = [&] {
    neighbours.begin();
    double old = 0;
    for (const auto& [probe, weight] : as_map(neighbours.weights(0, 1, {5.1, 1.5, 5})))
      if (grid()[probe].x < 5) old += weight;
    return old;
  };
  double expected = 1;
  for (int keyframe = 0; keyframe < 12; ++keyframe)
    EXPECT_NEAR(in_old_room(), expected *= 0.85, 1e-3) << keyframe;
  for (int keyframe = 12; keyframe < 40; ++keyframe) in_old_room();
  EXPECT_EQ(in_old_room(), 0);
}

TEST(ProbeNeighbours, AreNoneForASourceThatSeesNone) {
  const Mesh crate = testing::box({1, 1, 1});
  const std::vector<Material> materials{testing::uniform_material(0.1f)};
  const OcclusionGeometry surfaces(crate, materials);
  ProbeNeighbours neighbours({{3, 1, 3}, {5, 1, 3}}, &surfaces, 1);
  neighbours.begin();
  EXPECT_TRUE(neighbours.weights(0, 1, {0.5, 0.5, 0.5}).empty());
  EXPECT_EQ(neighbours.unseen(), 1u);
}

// A source that moves through a wall keeps its weights for 20 keyframes, and gets new ones at once.
TEST(ProbeNeighbours, StayForAMomentWhereTheSourceSeesNone) {
  const Mesh crate = testing::box({1, 1, 1});
  const std::vector<Material> materials{testing::uniform_material(0.1f)};
  const OcclusionGeometry surfaces(crate, materials);
  ProbeNeighbours neighbours({{3, 1, 0.5}, {5, 1, 0.5}, {-2, 1, 0.5}}, &surfaces, 1);
  neighbours.begin();
  const auto outside = as_map(neighbours.weights(0, 1, {1.4, 0.5, 0.5}));
  ASSERT_EQ(outside.size(), 2u);
  for (int keyframe = 0; keyframe < 20; ++keyframe) {
    neighbours.begin();
    EXPECT_EQ(as_map(neighbours.weights(0, 1, {0.5, 0.5, 0.5})), outside);
    EXPECT_FALSE(neighbours.is_settled());
  }
  neighbours.begin();
  EXPECT_TRUE(neighbours.weights(0, 1, {0.5, 0.5, 0.5}).empty());
  EXPECT_TRUE(neighbours.is_settled());
  EXPECT_EQ(neighbours.unseen(), 1u);
  neighbours.begin();
  EXPECT_EQ(as_map(neighbours.weights(0, 1, {-0.4, 0.5, 0.5})),
            (std::map<std::uint32_t, double>{{2, 1.0}}));
}

TEST(ProbeNeighbours, BearPlacesThatAreFarAwayOrNoNumbers) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ProbeNeighbours neighbours(grid(), nullptr, 1);
  const Vec3 home_m(3, 1, 3);
  for (const Vec3& odd_m :
       {Vec3(kNan), Vec3(0, kNan, 0), Vec3(kInfinity, 0, 0), Vec3(0, 0, -kInfinity),
        Vec3(1e30, 0, 0), Vec3(0, -1e30, 1e30), Vec3(1e300), Vec3(1e6, 0, 0)}) {
    for (int keyframe = 0; keyframe < 30; ++keyframe) {
      neighbours.begin();
      for (const ProbeWeight& weight : neighbours.weights(0, 1, odd_m)) {
        ASSERT_LT(weight.probe, grid().size());
        ASSERT_TRUE(weight.weight > 0 && weight.weight <= 1) << odd_m.x;
      }
    }
    neighbours.begin();
    EXPECT_EQ(as_map(neighbours.weights(0, 1, home_m)), settled_at(home_m)) << odd_m.x;
  }
}

TEST(ProbeNeighbours, BearProbesThatAreNoneOrInOnePlace) {
  for (const std::size_t count : {0, 1, 9, 100}) {
    ProbeNeighbours neighbours(std::vector<Vec3>(count, Vec3(1, 2, 3)), nullptr, 1);
    for (const Vec3& place_m : {Vec3(1, 2, 3), Vec3(1, 2, 4), Vec3(2, 2, 4)}) {
      neighbours.begin();
      for (const ProbeWeight& weight : neighbours.weights(0, 1, place_m))
        EXPECT_TRUE(weight.weight > 0 && weight.weight <= 1) << count;
    }
    EXPECT_LE(neighbours.unseen(), 1u);
  }
}

// A part comes between a source that rests and one of its probes, and goes again.
TEST(ProbeNeighbours, LoseTheProbeBehindAPartAndFindItAgain) {
  Level level;
  level.materials = {testing::uniform_material(0.2f)};
  OcclusionGeometry surfaces(level.mesh, level.materials);
  MovingParts parts;
  PartScene scene;
  surfaces.set_parts(&scene);
  const auto wall = *PartShape::make(testing::box({0.1, 4, 4}), level.materials);
  ProbeNeighbours neighbours({{-1, 2, 2}, {1.5, 2, 2}}, &surfaces, 1);
  const auto weights_after = [&](int keyframes) {
    scene.update(parts);
    std::map<std::uint32_t, double> weights;
    for (int k = 0; k < keyframes; ++k) {
      neighbours.begin();
      weights = as_map(neighbours.weights(0, 1, {-0.5, 2, 2}));
    }
    return weights;
  };
  const auto both = weights_after(1);
  EXPECT_GT(both.at(1), 0.001);
  const auto door = *parts.add(wall, {});
  EXPECT_EQ(weights_after(100), (std::map<std::uint32_t, double>{{0, 1}}));
  EXPECT_TRUE(neighbours.is_settled());
  ASSERT_TRUE(parts.remove(door).ok());
  EXPECT_LT(weights_after(1).at(1), both.at(1));
  EXPECT_FALSE(neighbours.is_settled());  // or a sampler would not ask again
  EXPECT_EQ(weights_after(100), both);
}

}  // namespace
}  // namespace clamor
