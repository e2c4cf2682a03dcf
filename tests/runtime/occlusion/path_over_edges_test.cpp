#include "runtime/occlusion/path_over_edges.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {
namespace {

// Edges at random places, some of which have the shortest path at an end, and edges beside each
// other, as those of a door's jamb, where places found by turns take hundreds of steps.
TEST(PathOverEdges, IsTheShortestAndTheSameFromEitherEnd) {
  const OcclusionGeometry free_field(Mesh{}, {});
  std::uint64_t rays = 0;
  int at_ends = 0;
  for (std::uint32_t draw = 0; draw < 200; ++draw) {
    std::uint32_t part = 0;
    const auto place_m = [&] {
      const RandomBits bits = philox(0x65646765, {draw, part++, 0, 0});
      return 4.0 * Vec3(unit(bits[0]), unit(bits[1]), unit(bits[2]));
    };
    const auto edge = [](const Vec3& from_m, const Vec3& to_m) {
      DiffractingEdge made;
      made.from_m = Vec3f(from_m), made.to_m = Vec3f(to_m);
      made.along = Vec3f(normalize(to_m - from_m));
      return made;
    };
    const Vec3 a_m = place_m(), b_m = place_m(), aside_m = 0.05 * normalize(place_m());
    const DiffractingEdge first = edge(a_m, b_m);
    const DiffractingEdge second =
        draw % 2 == 0 ? edge(place_m(), place_m()) : edge(a_m + aside_m, b_m + aside_m);
    const EdgeInAir one(free_field, first, 343, rays), other(free_field, second, 343, rays);
    const Vec3 from_m = place_m(), to_m = place_m();
    const auto z = path_over_edges(one, other, from_m, to_m),
               back = path_over_edges(other, one, to_m, from_m);
    const auto length_m = [&](double z1, double z2) {
      const Vec3 p = one.point_m(z1), q = other.point_m(z2);
      return length(p - from_m) + length(q - p) + length(to_m - q);
    };
    EXPECT_NEAR(back[1], z[0], 1e-3) << draw;
    EXPECT_NEAR(back[0], z[1], 1e-3) << draw;
    const double shortest_m = length_m(z[0], z[1]);
    EXPECT_NEAR(length_m(back[1], back[0]), shortest_m, 1e-9) << draw;
    constexpr int kSteps = 40;
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j)
        EXPECT_GE(length_m(one.length_m() * i / kSteps, other.length_m() * j / kSteps),
                  shortest_m - 1e-9)
            << draw;
    at_ends += z[0] == 0 || z[1] == 0 || z[0] == one.length_m() || z[1] == other.length_m();
  }
  EXPECT_GT(at_ends, 20);
}

}  // namespace
}  // namespace clamor
