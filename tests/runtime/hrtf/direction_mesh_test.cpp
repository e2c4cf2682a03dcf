#include "runtime/hrtf/direction_mesh.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/runtime/hrtf_mixing.h"

namespace clamor {
namespace {

using namespace testing;

TEST(DirectionMesh, FindsThreeNeighboursAroundEveryDirection) {
  const DirectionMesh mesh(kemar().directions);
  for (std::uint32_t d = 0; d < kemar().directions.size(); ++d) {
    const auto place = mesh.find(kemar().directions[d]);
    float own = 0;
    for (std::size_t k = 0; k < 3; ++k)
      if (place.corner[k] == d) own += place.share[k];
    EXPECT_GT(own, 0.999f) << d;
  }
  std::mt19937 random(9);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 20000; ++i) {
    const Vec3f from = normalize(Vec3f(normal(random), normal(random), normal(random)));
    const auto place = mesh.find(from);
    Vec3f sum(0);
    for (std::size_t k = 0; k < 3; ++k) sum += place.share[k] * kemar().directions[place.corner[k]];
    ASSERT_LT(length(normalize(sum) - from), 1e-4f) << i;
    // The measured directions are 5 to 10 degrees apart, except below the listener.
    if (from.z < -0.6f) continue;
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_GT(dot(kemar().directions[place.corner[k]], from), 0.97f) << i;
  }
}

// Queries follow a slow rotation, or jump anywhere.
TEST(DirectionMesh, FindsTheSameTriangleFromAnyStart) {
  const DirectionMesh mesh(kemar().directions);
  const auto between = [](const DirectionMesh::Place& place) {
    Vec3f sum(0);
    for (std::size_t k = 0; k < 3; ++k) sum += place.share[k] * kemar().directions[place.corner[k]];
    return sum;
  };
  std::mt19937 random(10);
  std::normal_distribution<float> normal;
  std::uint32_t last = 0;
  Vec3f from(1, 0, 0);
  for (int i = 0; i < 20000; ++i) {
    const float far = i % 100 == 0 ? 100.0f : 0.02f;
    from = normalize(from + far * Vec3f(normal(random), normal(random), normal(random)));
    const auto place = mesh.find(from, last);
    ASSERT_LT(length(between(place) - between(mesh.find(from))), 1e-5f) << i;
    ASSERT_NEAR(place.share[0] + place.share[1] + place.share[2], 1, 1e-6) << i;
  }
}

}  // namespace
}  // namespace clamor
