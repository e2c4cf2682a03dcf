#include "runtime/probes/probe_neighbours.h"

#include <cmath>
#include <limits>
#include <map>

#include <gtest/gtest.h>

#include "runtime/occlusion/occlusion_geometry.h"
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
  // Through the wall: the old room fades out within half a second.
  for (int keyframe = 0; keyframe < 25; ++keyframe) {
    neighbours.begin();
    neighbours.weights(0, 1, {5.1, 1.5, 5});
  }
  for (const auto& [probe, weight] : as_map(neighbours.weights(0, 1, {5.1, 1.5, 5})))
    EXPECT_GT(grid()[probe].x, 5) << weight;
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

TEST(ProbeNeighbours, BearPlacesThatAreFarAwayOrNoNumbers) {
  ProbeNeighbours neighbours(grid(), nullptr, 3);
  neighbours.begin();
  EXPECT_TRUE(neighbours.weights(0, 1, Vec3(std::numeric_limits<double>::quiet_NaN())).empty());
  const auto far = neighbours.weights(1, 1, Vec3(1e30, 0, 0));
  for (const ProbeWeight& weight : far) EXPECT_TRUE(std::isfinite(weight.weight));
}

}  // namespace
}  // namespace clamor
