#include "bake/mesh/triangle_tree.h"

#include <gtest/gtest.h>

#include "tests/bake/mesh/mesh_shapes.h"

namespace clamor {
namespace {

TEST(TriangleTree, AgreesWithBruteForce) {
  const Mesh soup = testing::random_soup(3, 700, 6);
  const TriangleTree tree(soup);
  for (std::uint32_t i = 0; i < 500; ++i) {
    const RandomBits bits = philox(2, {i, 0, 0, 0});
    const Vec3 point(8 * unit(bits[0]) - 1, 8 * unit(bits[1]) - 1, 8 * unit(bits[2]) - 1);
    const double within_m = 2 * unit(bits[3]);
    double nearest_m = within_m;
    std::optional<std::uint32_t> nearest;
    for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
      if (t % 5 == 0) continue;
      const auto& corners = soup.triangles[t];
      const Vec3 on =
          nearest_on_triangle(point, Vec3(soup.vertices_m[corners[0]]),
                              Vec3(soup.vertices_m[corners[1]]), Vec3(soup.vertices_m[corners[2]]));
      if (!(dot(on - point, on - point) < nearest_m * nearest_m)) continue;
      nearest_m = length(on - point);
      nearest = t;
    }
    const auto found =
        tree.nearest(point, within_m, [](std::uint32_t t, const Vec3&) { return t % 5 != 0; });
    ASSERT_EQ(found.has_value(), nearest.has_value());
    if (found) {
      EXPECT_NEAR(found->distance_m, nearest_m, 1e-12);
    }
  }
}

TEST(TriangleTree, FindsTheNearestPointInsideOnEdgesAndAtVertices) {
  const Vec3 a(0, 0, 0), b(4, 0, 0), c(0, 3, 0);
  for (std::uint32_t i = 0; i < 300; ++i) {
    const RandomBits bits = philox(6, {i, 0, 0, 0});
    const Vec3 p(8 * unit(bits[0]) - 2, 8 * unit(bits[1]) - 2, 4 * unit(bits[2]) - 2);
    const Vec3 on = nearest_on_triangle(p, a, b, c);
    // The nearest point lies on the triangle, and no vertex lies further towards p (the triangle is
    // convex).
    EXPECT_NEAR(on.z, 0, 1e-12);
    EXPECT_GE(on.x, -1e-12);
    EXPECT_GE(on.y, -1e-12);
    EXPECT_LE(on.x / 4 + on.y / 3, 1 + 1e-12);
    for (const Vec3& corner : {a, b, c}) EXPECT_LE(dot(corner - on, p - on), 1e-9);
  }
}

TEST(TriangleTree, VisitsNoMoreThanItMay) {
  const Mesh mesh = testing::crossing_slivers(2000);
  const TriangleTree tree(mesh);
  const auto none = [](std::uint32_t, const Vec3&) { return false; };
  std::size_t all = 0, some = 0;
  EXPECT_FALSE(tree.nearest({0, 0, 0}, 0.5, none, 1'000'000, &all));
  EXPECT_GT(all, 2000u);
  EXPECT_FALSE(tree.nearest({0, 0, 0}, 0.5, none, 100, &some));
  EXPECT_EQ(some, 100u);
  // What is found by then is returned.
  EXPECT_TRUE(tree.nearest({0, 0, 0}, 0.5, {}, 100));
}

TEST(TriangleTree, ReturnsTheFirstOfEquallyNearTriangles) {
  Mesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles.assign(50'000, {0, 1, 2});
  mesh.materials.assign(50'000, 0);
  const TriangleTree tree(mesh);
  const auto found = tree.nearest({0.2, 0.2, 0.5}, 1);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->triangle, 0u);
  EXPECT_EQ(found->distance_m, 0.5);
  EXPECT_FALSE(tree.nearest({0.2, 0.2, 0.5}, 0.4));
  EXPECT_FALSE(TriangleTree(Mesh{}).nearest({0, 0, 0}, 1e9));
}

}  // namespace
}  // namespace clamor
