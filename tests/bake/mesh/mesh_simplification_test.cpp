#include "bake/mesh/mesh_simplification.h"

#include <gtest/gtest.h>

#include "tests/bake/mesh/mesh_shapes.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

using testing::fine_box;
using testing::furthest_m;
using testing::material_areas_m2;
using testing::patch;
using testing::real_level;
using testing::whole_area_m2;

Simplification simplified(const Mesh& mesh, double tolerance_m) {
  return simplify(prepare_mesh(mesh), tolerance_m);
}

Vec3 on_globe(double u, double v) {
  const double turn = 2 * std::numbers::pi * u, rise = std::numbers::pi * (v - 0.5);
  return {std::cos(rise) * std::cos(turn), std::sin(rise), std::cos(rise) * std::sin(turn)};
}

TEST(MeshSimplification, ReducesAFinelyMeshedBoxToTheBox) {
  const Mesh mesh = fine_box({5, 4, 3}, 16);
  const Simplification simple = simplified(mesh, 1e-3);
  EXPECT_EQ(simple.mesh.triangles.size(), 12u);
  EXPECT_LT(simple.error_m, 1e-6);  // single precision at 5 m
  EXPECT_LT(furthest_m(mesh, simple.mesh, 5000), 1e-12);
  const auto before_m2 = material_areas_m2(mesh, 6), after_m2 = material_areas_m2(simple.mesh, 6);
  for (std::size_t m = 0; m < 6; ++m) EXPECT_NEAR(after_m2[m], before_m2[m], 1e-9);
  EXPECT_TRUE(prepare_mesh(simple.mesh).boundary_edges.empty());
}

TEST(MeshSimplification, StaysWithinItsOwnBoundAndTheToleranceBothWays_NoAsan) {
  // A sphere, and a rippled hill with a boundary.
  const Mesh shapes[] = {patch(96, 48, on_globe), patch(60, 60, [](double u, double v) {
                           return Vec3(6 * u, 0.2 * std::sin(9 * u) * std::cos(7 * v), 6 * v);
                         })};
  for (const Mesh& mesh : shapes) {
    std::size_t last = mesh.triangles.size();
    for (const double tolerance_m : {0.002, 0.01, 0.05}) {
      if (testing::kSanitized && tolerance_m < 0.01) continue;  // slow
      const Simplification simple = simplified(mesh, tolerance_m);
      EXPECT_LT(simple.mesh.triangles.size(), last);
      last = simple.mesh.triangles.size();
      EXPECT_LE(simple.error_m, tolerance_m);
      const double there_m = furthest_m(mesh, simple.mesh, 20'000),
                   back_m = furthest_m(simple.mesh, mesh, 20'000);
      EXPECT_LE(std::max(there_m, back_m), simple.error_m);
      EXPECT_GT(std::max(there_m, back_m), 0.1 * simple.error_m);  // the bound is not trivial
    }
  }
}

TEST(MeshSimplification, KeepsClosedSurfacesClosedAndUsesOriginalVerticesOnly) {
  const Mesh mesh = fine_box({5, 4, 3}, 20, [](const Vec3& p) {
    return p + Vec3(0.05 * std::sin(3 * p.y), 0.05 * std::sin(2 * p.z), 0.05 * std::sin(4 * p.x));
  });
  const PreparedMesh prepared = prepare_mesh(mesh);
  ASSERT_TRUE(prepared.boundary_edges.empty());
  const Simplification simple = simplify(prepared, 0.03);
  EXPECT_LT(simple.mesh.triangles.size(), mesh.triangles.size() / 3);
  EXPECT_TRUE(prepare_mesh(simple.mesh).boundary_edges.empty());
  const auto before = [](const Vec3f& a, const Vec3f& b) {
    return std::array{a.x, a.y, a.z} < std::array{b.x, b.y, b.z};
  };
  std::vector<Vec3f> places = prepared.mesh.vertices_m;
  std::sort(places.begin(), places.end(), before);
  for (const Vec3f& vertex : simple.mesh.vertices_m)
    EXPECT_TRUE(std::binary_search(places.begin(), places.end(), vertex, before));
}

TEST(MeshSimplification, MovesNoBorderBetweenMaterials) {
  Mesh floor = patch(40, 40, [](double u, double v) { return Vec3(8 * u, 0, 8 * v); });
  for (std::size_t t = 0; t < floor.triangles.size(); ++t) {
    const Vec3f& corner = floor.vertices_m[floor.triangles[t][0]];
    const Vec3f centre = corner + Vec3f(0.1f, 0, 0.1f);
    if (std::abs(centre.x - 4) < 2 && std::abs(centre.z - 3) < 1.2) floor.materials[t] = 1;
  }
  const auto before_m2 = material_areas_m2(floor, 2);
  const Simplification simple = simplified(floor, 0.1);
  EXPECT_LT(simple.mesh.triangles.size(), 40u);
  const auto after_m2 = material_areas_m2(simple.mesh, 2);
  for (std::size_t m = 0; m < 2; ++m) EXPECT_NEAR(after_m2[m], before_m2[m], 1e-4);
}

TEST(MeshSimplification, OpensNoCrackBetweenWallAndFloor) {
  // A curved, finely divided lower edge of a wall touches the middle of the floor.
  Mesh mesh = patch(10, 10, [](double u, double v) { return Vec3(8 * u, 0, 8 * v); });
  const Mesh wall = patch(64, 8, [](double u, double v) {
    return Vec3(1 + 6 * u, 3 * v, 4 + 0.02 * std::sin(12 * u));
  });
  testing::add(mesh, wall);
  const Simplification simple = simplified(mesh, 0.05);
  EXPECT_LT(simple.mesh.triangles.size(), mesh.triangles.size());
  // Every point of the old lower edge still lies on a wall and on the floor.
  const TriangleTree tree(simple.mesh);
  for (std::size_t i = 0; i <= 64; ++i) {
    const Vec3 foot(wall.vertices_m[i]);
    const auto upright = [&](std::uint32_t t, const Vec3&) {
      for (const auto corner : simple.mesh.triangles[t])
        if (simple.mesh.vertices_m[corner].y > 0) return true;
      return false;
    };
    const auto nearest = tree.nearest(foot, 1, upright);
    ASSERT_TRUE(nearest.has_value());
    EXPECT_LT(nearest->distance_m, 2e-4);
  }
}

TEST(MeshSimplification, KeepsToleranceAndAreaOfARealHall_NoAsan) {
  const auto level = real_level("sibenik.glb");
  if (!level) GTEST_SKIP() << "not on this machine: sibenik.glb";
  const PreparedMesh prepared = prepare_mesh(level->mesh);
  const Simplification simple = simplify(prepared, 0.02);
  EXPECT_LT(simple.mesh.triangles.size(), prepared.mesh.triangles.size() * 9 / 10);
  EXPECT_LE(furthest_m(prepared.mesh, simple.mesh, 20'000), 0.02);
  EXPECT_LE(furthest_m(simple.mesh, prepared.mesh, 20'000), 0.02);
  EXPECT_NEAR(whole_area_m2(simple.mesh), whole_area_m2(prepared.mesh),
              0.002 * whole_area_m2(prepared.mesh));
}

}  // namespace
}  // namespace clamor
