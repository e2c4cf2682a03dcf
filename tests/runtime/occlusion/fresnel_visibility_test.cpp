// fresnel_visibility_test.cpp: diffraction by counting free paths, against the exact solution for a
// half-plane and against counting many paths.
#include "runtime/occlusion/fresnel_visibility.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "common/random.h"
#include "tests/rooms.h"
#include "tests/runtime/occlusion/visibility_reference.h"

namespace clamor {
namespace {

using Complex = std::complex<double>;
constexpr double kSound_mps = 343.2, kPi = std::numbers::pi;

// --- The exact field behind a rigid half-plane --------------------------------------------------
//
// H. M. Macdonald. A Class of Diffraction Problems. Proc. London Math. Soc. 14, 1915; in J. J.
// Bowman, T. B. A. Senior, P. L. E. Uslenghi. Electromagnetic and Acoustic Scattering by Simple
// Shapes, 1969, section 8.3: a point source at (r0, phi0, 0) and a half-plane at phi = 0 give
//
//   p = e^(ikR) / R  F(kR, xi) + e^(ikR') / R' F(kR', xi'),   F(x, xi) = I(xi) / I(infinity),
//   I(xi) = integral from -xi to infinity of H_1(x + m^2) / sqrt(2 x + m^2) dm,
//   xi = 2 sqrt(k r r0 / (R1 + R)) cos((phi - phi0) / 2),  xi' with phi + phi0 and R',
//
// R the distance to the source, R' to its image, R1 round the edge. The path of integration leaves
// the real axis at 45 degrees, where the integrand falls as exp(-s^2).

// Hankel's asymptotic series with five terms; the error is 1e-3 at |z| = 3.
Complex hankel1(Complex z) {
  const Complex i(0, 1);
  constexpr double kTerms[] = {3.0 / 8, -15.0 / 128, 315.0 / 3072, -14175.0 / 98304};
  Complex sum = 1, power = 1;
  for (const double term : kTerms) {
    power *= i / z;
    sum += term * power;
  }
  return std::sqrt(2.0 / (kPi * z)) * std::exp(i * (z - 3 * kPi / 4)) * sum;
}

Complex integral_from(double x, double start) {  // start >= 0
  const Complex turn = std::polar(1.0, kPi / 4);
  constexpr double kStep = 0.02, kEnd = 5;
  Complex sum = 0;
  for (double s = kStep / 2; s < kEnd; s += kStep) {
    const Complex m = start + s * turn;
    sum += hankel1(x + m * m) / std::sqrt(2 * x + m * m);
  }
  return sum * kStep * turn;
}

Complex macdonald(double x, double xi) {
  const Complex whole = 2.0 * integral_from(x, 0);
  return xi <= 0 ? integral_from(x, -xi) / whole : 1.0 - integral_from(x, xi) / whole;
}

// Power behind the half-plane x = 0, y < 0, relative to a free field, averaged over an octave.
double exact_power(const Vec3& from_m, const Vec3& to_m, std::size_t band) {
  const auto angle = [](const Vec3& at) {  // from the half-plane, on the source's side
    const double phi = std::atan2(-at.x, -at.y);
    return phi < 0 ? phi + 2 * kPi : phi;
  };
  const double r0 = std::hypot(from_m.x, from_m.y), r = std::hypot(to_m.x, to_m.y);
  const double direct_m = length(to_m - from_m);
  const double image_m = length(to_m - Vec3(-from_m.x, from_m.y, from_m.z));
  const double round_m = std::hypot(r + r0, to_m.z - from_m.z);
  constexpr int kSteps = 6;
  double power = 0;
  for (int step = 0; step < kSteps; ++step) {
    const double hz = 1000 * std::exp2(static_cast<double>(band) - 4.5 + (step + 0.5) / kSteps);
    const double k = 2 * kPi * hz / kSound_mps;
    const auto radiation = [&](double distance_m, double phi) {
      const double xi = 2 * std::sqrt(k * r * r0 / (round_m + distance_m)) * std::cos(phi / 2);
      return std::polar(1 / distance_m, k * distance_m) * macdonald(k * distance_m, xi);
    };
    power += std::norm(radiation(direct_m, angle(to_m) - angle(from_m)) +
                       radiation(image_m, angle(to_m) + angle(from_m)));
  }
  return power / kSteps * direct_m * direct_m;
}

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

// A sheet at x = 0, y < 0, so large that only one edge matters.
Mesh half_plane() {
  Mesh mesh;
  mesh.vertices_m = {{0, 0, -1000}, {0, 0, 1000}, {0, -1000, 1000}, {0, -1000, -1000}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.materials = {0, 0};
  return mesh;
}

double decibels(double power) { return 10 * std::log10(std::max(power, 1e-12)); }

TEST(FresnelVisibility, IsWithin3DecibelsOfTheExactHalfPlaneDownToMinus15Decibels) {
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

TEST(FresnelVisibility, IsWithinADecibelOfAThousandPathsPerBand) {
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
  EXPECT_LT(visible[7], 0.1f);
  for (std::size_t b = 1; b < kBandCount; ++b) EXPECT_LE(visible[b], visible[b - 1] + 0.05f);
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
