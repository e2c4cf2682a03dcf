#include "bake/trace/scene.h"

#include <cmath>

#include <gtest/gtest.h>

#include "common/random.h"
#include "tests/box_mesh.h"
#include "tests/memory_limits.h"

namespace clamor {
namespace {

using testing::box;

Vec3 direction(std::uint32_t i) {
  const RandomBits bits = philox(3, {i, 0, 0, 0});
  const double z = 1 - 2 * unit(bits[0]), phi = 2 * std::numbers::pi * unit(bits[1]);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

TEST(Scene, AgreesWithTheSlabTestOnABox) {
  const Mesh mesh = box({5, 4, 3}, {0, 1, 2, 3, 4, 5});
  const Scene scene(mesh);
  const Vec3 origin(1.3, 1.7, 1.1), size(5, 4, 3);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const Vec3 d = direction(i);
    double nearest_m = 1e9;
    std::uint16_t face = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double t =
          d[axis] > 0 ? (size[axis] - origin[axis]) / d[axis] : -origin[axis] / d[axis];
      if (t < nearest_m) {
        nearest_m = t;
        face = static_cast<std::uint16_t>(2 * axis + (d[axis] > 0 ? 1 : 0));
      }
    }
    const auto hit = scene.intersect(origin, d);
    ASSERT_TRUE(hit);
    // The vertices are exact in single precision, so the distance is exact in double.
    EXPECT_NEAR(hit->distance_m, nearest_m, 1e-12);
    EXPECT_EQ(hit->material, face);
    EXPECT_LT(dot(hit->normal, d), 0);
  }
}

TEST(Scene, ReflectsOnBothSides) {
  const Mesh mesh = box({1, 1, 1});
  const Scene scene(mesh);
  const auto outside = scene.intersect({0.5, 0.5, 3}, {0, 0, -1});
  ASSERT_TRUE(outside);
  EXPECT_NEAR(outside->distance_m, 2, 1e-12);
  EXPECT_GT(outside->normal.z, 0.99);
}

TEST(Scene, DoesNotLeakBetweenTheTrianglesOfAClosedRoom) {
  const Mesh mesh = box({6, 8, 3});
  const Scene scene(mesh);
  const Vec3 start(2, 3, 1.2);
  Vec3 origin = start, normal(0);
  std::uint32_t lost = 0;
  // A random walk from wall to wall. Without the offset, one ray in eight would be lost.
  for (std::uint32_t i = 0; i < 200000; ++i) {
    Vec3 d = direction(i);
    if (dot(d, normal) < 0) d = -d;
    const auto hit = scene.intersect(origin, d);
    lost += !hit;
    normal = hit ? hit->normal : Vec3(0);
    origin = hit ? scene.away_from_surface(hit->point_m, normal) : start;
  }
  EXPECT_EQ(lost, 0u);
}

TEST(Scene, WithoutTrianglesNothingIsHit) {
  const Mesh nothing;
  const Scene scene(nothing);
  EXPECT_FALSE(scene.intersect({0, 0, 0}, {0, 0, 1}));
}

TEST(Scene, TrianglesWithoutAreaAreNotHit) {
  Mesh mesh;
  mesh.vertices_m = {{-1, 0, 1}, {1, 0, 1}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 2}};
  mesh.materials = {0};
  const Scene scene(mesh);
  EXPECT_FALSE(scene.intersect({0, 0, 0}, {0, 0, 1}));
}

// Embree returns null if it runs out of memory. Each child process has a memory limit above this
// process's use, from too little for the triangles to enough for all.
TEST(Scene, WithoutMemoryThrowsAndDoesNotCrash) {
  const Mesh mesh = testing::many_triangles(200'000);
  testing::expect_throws_without_memory([&mesh] { const Scene scene(mesh, Scene::Build::kQuick); });
}

}  // namespace
}  // namespace clamor
