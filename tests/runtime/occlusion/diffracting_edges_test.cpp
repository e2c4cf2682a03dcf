#include "runtime/occlusion/diffracting_edges.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/occlusion/edge_in_air.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "tests/box_mesh.h"

namespace clamor::testing {
namespace {

// Boxes of all sizes, in a room of 10 m.
Mesh cluttered_room(std::mt19937& random) {
  std::uniform_real_distribution<double> place_m(0, 10), size_m(0.05, 2);
  Mesh all;
  for (int i = 0; i < 200; ++i) {
    const Vec3f low_m(place_m(random), place_m(random), place_m(random));
    const Mesh one = box({size_m(random), size_m(random), size_m(random)});
    const auto first = static_cast<std::uint32_t>(all.vertices_m.size());
    for (const Vec3f& vertex_m : one.vertices_m) all.vertices_m.push_back(low_m + vertex_m);
    for (const auto& triangle : one.triangles)
      all.triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
  }
  return all;
}

// Asks every edge.
std::vector<double> nearest_of_all(const DiffractingEdges& edges, const Vec3& from_m,
                                   const Vec3& to_m, std::size_t count, double longest_m) {
  std::vector<double> detours_m;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const DiffractingEdge& edge = edges[e];
    if (!edge.is_between(from_m, to_m) || !(edge.is_in_air(from_m) || edge.is_in_air(to_m)))
      continue;
    const PointsAroundEdge points(edge, from_m, to_m);
    const double end_m = length(Vec3(edge.to_m) - Vec3(edge.from_m));
    const double detour_m =
        points.path_m(std::clamp(points.apex_m(), 0.0, end_m)) - length(to_m - from_m);
    if (detour_m <= longest_m) detours_m.push_back(detour_m);
  }
  std::sort(detours_m.begin(), detours_m.end());
  detours_m.resize(std::min(detours_m.size(), count));
  return detours_m;
}

// Points are inside and outside of the room, as image sources are, and on an edge.
TEST(DiffractingEdges, AreThoseOfTheShortestDetoursAmongAll) {
  std::mt19937 random(1);
  const DiffractingEdges edges(cluttered_room(random));
  ASSERT_GT(edges.size(), 2000u);
  std::uniform_real_distribution<double> near_m(0, 10), far_m(-20, 30);
  for (int i = 0; i < 200; ++i) {
    const Vec3 to_m(near_m(random), near_m(random), near_m(random));
    Vec3 from_m(far_m(random), far_m(random), far_m(random));
    if (i % 10 == 0) from_m = Vec3(edges[static_cast<std::size_t>(7 * i)].from_m);
    const double longest_m = i % 3 == 0 ? 0.1 : 5;
    std::vector<EdgeBetween> found;
    edges.find_nearest(from_m, to_m, 24, longest_m, found);
    const std::vector<double> expected = nearest_of_all(edges, from_m, to_m, 24, longest_m);
    ASSERT_EQ(found.size(), expected.size());
    // Ends of edges are rounded to 1e-6 m, by which boxes may be too small.
    for (std::size_t k = 0; k < found.size(); ++k)
      EXPECT_NEAR(found[k].detour_m, expected[k], 1e-5) << i;
  }
}

// Integrals over an edge end there, but for rounding, which the C library decides.
TEST(EdgeInAir, HasItsWholeWeightAtEndsThatRoundingMoves) {
  DiffractingEdge edge;
  edge.to_m = {0, 0, 2};
  edge.along = {0, 0, 1};
  const OcclusionGeometry free_field(Mesh{}, {});
  std::uint64_t rays = 0;
  const EdgeInAir in_air(free_field, edge, 343, rays);
  for (const double z : {-1e-17, 0.0, 1.0, 2.0, std::nextafter(2.0, 3.0)})
    EXPECT_EQ(in_air.weight(z), 1) << z;
}

}  // namespace
}  // namespace clamor::testing
