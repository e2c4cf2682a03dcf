// fresnel_visibility_test.cpp: diffraction by counting free paths, against the exact solution for a
// half-plane and against counting many paths.
#include "runtime/occlusion/fresnel_visibility.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "common/random.h"
#include "tests/rooms.h"
#include "tests/runtime/occlusion/half_plane_reference.h"
#include "tests/runtime/occlusion/visibility_reference.h"

namespace clamor {
namespace {

using testing::exact_power;
using testing::half_plane;
using testing::integral_from;
using testing::kSound_mps;
using testing::macdonald;

TEST(HalfPlaneReference, HasHalfTheAmplitudeAtItsEdgeAndAllOfItFarAway) {
  // At the shadow boundary the incident wave contributes exactly a half.
  for (const double x : {3.0, 30.0, 3000.0}) EXPECT_NEAR(std::abs(macdonald(x, 0)), 0.5, 1e-9);
  EXPECT_NEAR(std::abs(macdonald(100, 60)), 1, 0.01);
  EXPECT_NEAR(std::abs(macdonald(100, -60)), 0, 0.01);
  // Far from the edge, the whole integral is a spherical wave.
  const double at_3 = 3 * std::abs(integral_from(3, 0)),
               at_500 = 500 * std::abs(integral_from(500, 0));
  EXPECT_NEAR(at_3 / at_500, 1, 2e-3);
}

double decibels(double power) { return 10 * std::log10(std::max(power, 1e-12)); }

TEST(FresnelVisibility, IsWithin3DecibelsOfTheExactHalfPlaneDownToMinus15Decibels_NoAsan) {
  const OcclusionGeometry geometry(half_plane(), std::vector<Material>(1));
  int count = 0;
  for (const double before_m : {1.0, 3.0, 10.0})
    for (const double behind_m : {2.0, 5.0, 25.0})
      for (const double clearance_m : {-1.5, -0.7, -0.3, -0.1, -0.03, 0.02, 0.1, 0.25, 0.6, 1.3})
        for (const double tilt : {-0.4, 0.0, 0.7}) {
          const Vec3 from(-before_m, clearance_m - tilt * before_m, 0.3 * before_m);
          const Vec3 to(behind_m, clearance_m + tilt * behind_m, -0.2 * behind_m);
          std::uint64_t rays = 0;
          const Bands visible =
              fresnel_visibility(geometry, {from, to, kSound_mps}, kFinePaths, rays);
          for (std::size_t b = 0; b < kBandCount; ++b) {
            const double exact_db = decibels(exact_power(from, to, b));
            if (exact_db < -15) continue;
            const double off_db = decibels(visible[b]) - exact_db;
            EXPECT_NEAR(off_db, 0, 3)
                << "band " << b << ", " << before_m << " m and " << behind_m << " m from the edge, "
                << clearance_m << " m above it, tilt " << tilt << ", exact " << exact_db << " dB";
            ++count;
          }
        }
  EXPECT_GT(count, 1000);
}

// At walking speed, 2.8 cm are 20 ms.
TEST(FresnelVisibility, FallsByLessThan3DecibelsPer20MillisecondsOnAWalkIntoAShadow_NoAsan) {
  const OcclusionGeometry geometry(half_plane(), std::vector<Material>(1));
  Bands last{};
  for (double y = 2; y > -6; y -= 0.028) {
    const Vec3 from(-3, -0.5, 0.3), to(2, y, -0.2);
    std::uint64_t rays = 0;
    const Bands visible = fresnel_visibility(geometry, {from, to, kSound_mps}, kFinePaths, rays);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double exact_db = decibels(exact_power(from, to, b));
      if (exact_db > -33) {
        EXPECT_NEAR(decibels(visible[b]), exact_db, 3) << b << " at " << y;
      }
      if (y < 2) {
        EXPECT_LT(std::abs(decibels(visible[b]) - decibels(last[b])), 3) << b << " at " << y;
      }
    }
    last = visible;
  }
}

// A room of 10 x 8 x 3 m: a wall across at x = 5 m with a door of 1 x 2 m, a pillar in one half and
// a low screen in the other.
Mesh furnished() {
  Mesh mesh = testing::box({10, 8, 3});
  const auto quad = [&mesh](const Vec3f& a, const Vec3f& b, const Vec3f& c, const Vec3f& d) {
    testing::add_quad(mesh, {a, b, c, d});
  };
  quad({5, 0, 0}, {5, 3.5f, 0}, {5, 3.5f, 3}, {5, 0, 3});
  quad({5, 4.5f, 0}, {5, 8, 0}, {5, 8, 3}, {5, 4.5f, 3});
  quad({5, 3.5f, 2}, {5, 4.5f, 2}, {5, 4.5f, 3}, {5, 3.5f, 3});
  quad({2, 2, 0}, {2.4f, 2, 0}, {2.4f, 2, 3}, {2, 2, 3});
  quad({2, 2.4f, 0}, {2.4f, 2.4f, 0}, {2.4f, 2.4f, 3}, {2, 2.4f, 3});
  quad({2, 2, 0}, {2, 2.4f, 0}, {2, 2.4f, 3}, {2, 2, 3});
  quad({2.4f, 2, 0}, {2.4f, 2.4f, 0}, {2.4f, 2.4f, 3}, {2.4f, 2, 3});
  quad({7, 1, 0}, {7, 6, 0}, {7, 6, 1.2f}, {7, 1, 1.2f});
  return mesh;
}

TEST(FresnelVisibility, IsWithinADecibelOfAThousandPathsPerBand_NoAsan) {
  int close = 0, first = 0, count = 0;
  std::uint64_t rays = 0;
  for (const Mesh& mesh : {half_plane(), furnished()}) {
    const OcclusionGeometry geometry(mesh, std::vector<Material>(1));
    for (std::uint32_t i = 0; i < 200; ++i) {
      const RandomBits a = philox(5, {i, 0, 0, 0}), b = philox(5, {i, 1, 0, 0});
      LineOfSight line{Vec3f(10 * unit(a[0]), 8 * unit(a[1]), 3 * unit(a[2])),
                       Vec3f(10 * unit(b[0]), 8 * unit(b[1]), 3 * unit(b[2])), kSound_mps};
      if (mesh.triangles.size() == 2) {
        line.from_m -= Vec3f(5, 4, 0);
        line.to_m -= Vec3f(5, 4, 0);
      }
      const Bands first_look = fresnel_visibility(geometry, line, kMediumPaths, rays);
      const Bands close_look = fresnel_visibility(geometry, line, kFinePaths, rays);
      for (std::size_t band = 0; band < kBandCount; ++band) {
        const double slow_db = decibels(testing::slow_visibility(geometry, line, band, 1000, rays));
        if (slow_db < -15) continue;
        ++count;
        first += std::abs(decibels(first_look[band]) - slow_db) < 1;
        const double off_db = decibels(close_look[band]) - slow_db;
        close += std::abs(off_db) < 1;
        EXPECT_NEAR(off_db, 0, 1) << "band " << band << " of line " << i << ", " << slow_db;
      }
    }
  }
  EXPECT_GT(count, 2000);
  EXPECT_EQ(close, count);
  EXPECT_GT(first, 0.9 * count);
}

TEST(FresnelVisibility, IsOneEverywhereInAConvexRoom) {
  const OcclusionGeometry geometry(testing::box({6, 8, 2.5}), std::vector<Material>(1));
  for (std::uint32_t i = 0; i < 500; ++i) {
    const RandomBits a = philox(6, {i, 0, 0, 0}), b = philox(6, {i, 1, 0, 0});
    const Vec3f from(6 * unit(a[0]), 8 * unit(a[1]), 2.5 * unit(a[2]));
    const Vec3f to(6 * unit(b[0]), 8 * unit(b[1]), 2.5 * unit(b[2]));
    std::uint64_t rays = 0;
    EXPECT_EQ(fresnel_visibility(geometry, {from, to, kSound_mps}, kMediumPaths, rays),
              same_in_all_bands(1))
        << i;
  }
}

TEST(FresnelVisibility, BehindAPillarIsLowInHighBandsAndHighInLowOnes) {
  const OcclusionGeometry geometry(furnished(), std::vector<Material>(1));
  std::uint64_t rays = 0;
  const Bands visible = fresnel_visibility(
      geometry, {{2.2f, 0.5f, 1.5f}, {2.2f, 5.5f, 1.5f}, kSound_mps}, kFinePaths, rays);
  EXPECT_GT(visible[0], 0.9f);
  EXPECT_LT(visible[7], 0.15f);
  for (std::size_t b = 1; b < kBandCount; ++b) EXPECT_LE(visible[b], visible[b - 1] + 0.05f);
}

// The listener steps through the plane of a wall in its doorway, from 20 cm before it to 40 cm
// behind it.
TEST(FresnelVisibility, ChangesByLessThanADecibelPerStepThroughADoorsPlane) {
  const OcclusionGeometry geometry(furnished(), std::vector<Material>(1));
  for (const Vec3f& from_m : {Vec3f(1, 4.4f, 1), Vec3f(0.01f, 4, 1.2f)}) {
    Bands last = same_in_all_bands(1);
    for (double x = 4.8; x < 5.4; x += 0.015) {
      std::uint64_t rays = 0;
      const Bands visible =
          fresnel_visibility(geometry, {from_m, Vec3f(x, 4.0, 1.2), kSound_mps}, kFinePaths, rays);
      for (std::size_t b = 0; b < kBandCount; ++b)
        EXPECT_LT(std::abs(decibels(visible[b]) - decibels(last[b])), 1) << b << " at " << x;
      last = visible;
    }
  }
}

TEST(FresnelVisibility, ThroughAClosedWallIsZeroInEveryBand) {
  const Vec3 size(10, 8, 3);
  Mesh mesh = testing::box(size);
  testing::add_wall_across(mesh, 5, size, 0);
  const OcclusionGeometry geometry(mesh, std::vector<Material>(1));
  for (std::uint32_t i = 0; i < 300; ++i) {
    const RandomBits a = philox(7, {i, 0, 0, 0}), b = philox(7, {i, 1, 0, 0});
    const Vec3f from(4.99 * unit(a[0]), 8 * unit(a[1]), 3 * unit(a[2]));
    const Vec3f to(5.01 + 4.99 * unit(b[0]), 8 * unit(b[1]), 3 * unit(b[2]));
    std::uint64_t rays = 0;
    EXPECT_EQ(fresnel_visibility(geometry, {from, to, kSound_mps}, kMediumPaths, rays), Bands{});
  }
}

}  // namespace
}  // namespace clamor
