// direct_sound_test.cpp: diffraction by edges, against exact solutions.
#include "runtime/occlusion/direct_sound.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/occlusion/edge_diffraction.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "tests/rooms.h"
#include "tests/runtime/door_leaf.h"
#include "tests/runtime/occlusion/half_plane_reference.h"
#include "tests/runtime/two_rooms.h"

namespace clamor {
namespace {

using testing::Complex;
using testing::kPi;
using testing::kSound_mps;

double level_db(double power) { return 10 * std::log10(std::max(power, 1e-12)); }

DirectSound heard(const OcclusionGeometry& geometry, const Vec3& from_m, const Vec3& to_m) {
  const LineOfSight line{Vec3f(from_m), Vec3f(to_m), kSound_mps};
  std::uint64_t rays = 0;
  bool line_is_free = true;
  const Bands zone = fresnel_visibility(geometry, line, kMediumPaths, rays, &line_is_free);
  return direct_sound(geometry, line, zone, line_is_free, rays);
}

// The largest change of a band's level from one visibility to the next, of what is above -30 dB.
double step_db(const Bands& a, const Bands& b) {
  double largest = 0;
  for (std::size_t band = 0; band < kBandCount; ++band)
    largest = std::max(
        largest, std::abs(level_db(std::max(a[band], 1e-3f)) - level_db(std::max(b[band], 1e-3f))));
  return largest;
}

TEST(DirectSound, IsWithinADecibelOfTheExactHalfPlaneDownToMinus30Decibels_NoAsan) {
  const OcclusionGeometry geometry(testing::half_plane(), std::vector<Material>(1));
  const Vec3 from(-3, -0.5, 0.6);
  int count = 0;
  Bands last_off_db{};
  for (int i = 0; i < 200; ++i) {
    const Vec3 to(2, 2.5 - 0.04 * i, -0.4);
    const Bands power = heard(geometry, from, to).visibility;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double exact_db = level_db(testing::exact_power(from, to, b));
      if (exact_db < -30) continue;
      const double off_db = level_db(static_cast<double>(power[b])) - exact_db;
      EXPECT_NEAR(off_db, 0, 1) << b << " at " << to.y;
      // It is as continuous as the exact sound.
      if (i > 0) {
        EXPECT_NEAR(off_db, static_cast<double>(last_off_db[b]), 0.75) << b << " at " << to.y;
      }
      last_off_db[b] = static_cast<float>(off_db);
      ++count;
    }
  }
  EXPECT_GT(count, 1000);
}

// A line source and a rigid wedge: p = i pi / (2 Theta) sum eps_n J(k r<) H(k r>) cos cos, of order
// nu n, against i / 4 H_0(k L) in a free field (Bowman et al., section 6.2). Behind the edge, a
// point source's sound spreads along the edge as well.
double exact_wedge_power(double r_from_m, double from_rad, double r_to_m, double to_rad,
                         double hz) {
  const double air_rad = 1.5 * kPi, nu = kPi / air_rad, k = 2 * kPi * hz / kSound_mps;
  const double near_m = std::min(r_from_m, r_to_m), far_m = std::max(r_from_m, r_to_m);
  Complex sum = 0;
  for (int n = 0; nu * n < k * near_m + 60; ++n) {
    const double order = nu * n;
    const double j = std::cyl_bessel_j(order, k * near_m);
    const Complex h(std::cyl_bessel_j(order, k * far_m), std::cyl_neumann(order, k * far_m));
    const Complex term = j * h * std::cos(order * from_rad) * std::cos(order * to_rad);
    if (!std::isfinite(std::abs(term))) break;
    sum += (n == 0 ? 1.0 : 2.0) * term;
  }
  const double straight_m =
      std::sqrt(near_m * near_m + far_m * far_m - 2 * near_m * far_m * std::cos(to_rad - from_rad));
  const Complex direct(std::cyl_bessel_j(0, k * straight_m), std::cyl_neumann(0, k * straight_m));
  return std::norm(2 * kPi / air_rad * sum / direct) * straight_m / (near_m + far_m);
}

TEST(DirectSound, IsWithinOneAndAHalfDecibelsOfTheExactWedge) {
  Mesh mesh;
  testing::add_quad(
      mesh, {Vec3f(0, 0, -500), Vec3f(0, 0, 500), Vec3f(1000, 0, 500), Vec3f(1000, 0, -500)});
  testing::add_quad(
      mesh, {Vec3f(0, 0, -500), Vec3f(0, 0, 500), Vec3f(0, -1000, 500), Vec3f(0, -1000, -500)});
  const OcclusionGeometry geometry(mesh, std::vector<Material>(1));
  const auto place = [](double r_m, double angle_rad) {
    return Vec3(r_m * std::cos(angle_rad), r_m * std::sin(angle_rad), 0);
  };
  const double from_rad = kPi / 3;  // its shadow begins at 240 degrees
  for (const double to_deg : {242.0, 245.0, 250.0, 255.0, 260.0, 265.0}) {
    const double to_rad = to_deg * kPi / 180;
    const Bands power = heard(geometry, place(2, from_rad), place(1, to_rad)).visibility;
    for (std::size_t b = 0; b < 6; ++b) {
      double exact = 0;
      for (const double third : {-1.0, 0.0, 1.0})
        exact += exact_wedge_power(2, from_rad, 1, to_rad,
                                   62.5 * std::exp2(static_cast<double>(b) + third / 3)) /
                 3;
      EXPECT_NEAR(level_db(static_cast<double>(power[b])), level_db(exact), 1.5)
          << b << " at " << to_deg;
    }
  }
}

// The integral of edge_diffraction.h along a straight edge of a thin sheet, by its definition, in
// steps of 2 mm. `face` points along the sheet.
Complex along_edge(const Vec3& a, const Vec3& b, const Vec3& face, const Vec3& from_m,
                   const Vec3& to_m, double k) {
  const double length_m = length(b - a), straight_m = length(to_m - from_m);
  const Vec3 along = (b - a) / length_m, up = cross(along, face);
  const auto polar = [&](const Vec3& point_m) {  // z, r and angle
    const Vec3 at = point_m - a;
    double angle = std::atan2(dot(at, up), dot(at, face));
    if (angle < 0) angle += 2 * kPi;
    return Vec3(dot(at, along), std::hypot(dot(at, up), dot(at, face)), angle);
  };
  const Vec3 s = polar(from_m), r = polar(to_m);
  Complex sum = 0;
  const int steps = static_cast<int>(length_m / 0.002);
  for (int i = 0; i < steps; ++i) {
    const double z = (i + 0.5) * length_m / steps;
    const double m = std::hypot(s.y, z - s.x), l = std::hypot(r.y, z - r.x);
    const double eta = std::acosh((m * l + (z - s.x) * (z - r.x)) / (s.y * r.y));
    double beta = 0;
    for (const double source : {1, -1})
      for (const double listener : {1, -1}) {
        const double phi = 0.5 * (kPi + source * s.z + listener * r.z);
        beta += std::sin(phi) / (std::cosh(0.5 * eta) - std::cos(phi));
      }
    sum += -0.5 / (4 * kPi) * beta * straight_m / (m * l) *
           std::polar(length_m / steps, k * (m + l - straight_m));
  }
  return sum;
}

TEST(DirectSound, BehindAScreenIsTheSumOfItsEdges) {
  // 1.4 m wide and 1 m high.
  const std::vector<Vec3> corners{{0, -0.5, -0.7}, {0, -0.5, 0.7}, {0, 0.5, 0.7}, {0, 0.5, -0.7}};
  Mesh mesh;
  testing::add_quad(mesh,
                    {Vec3f(corners[0]), Vec3f(corners[1]), Vec3f(corners[2]), Vec3f(corners[3])});
  const OcclusionGeometry geometry(mesh, std::vector<Material>(1));
  const Vec3 from(-1.5, 0.1, -0.05);
  for (const Vec3 to : {Vec3(1.2, 0.05, 0.1), Vec3(1, -0.3, 0.2), Vec3(1.5, 0.8, 0.4)}) {
    const bool is_free = geometry.is_free(Vec3f(from), Vec3f(to));
    const Bands power = heard(geometry, from, to).visibility;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      double expected = 0;
      for (const double third : {-1.0, 0.0, 1.0}) {
        const double k =
            2 * kPi * 62.5 * std::exp2(static_cast<double>(b) + third / 3) / kSound_mps;
        Complex pressure = is_free ? 1 : 0;
        for (std::size_t c = 0; c < 4; ++c) {
          const Vec3 &a = corners[c], &d = corners[(c + 1) % 4];
          pressure += along_edge(a, d, normalize(-0.5 * (a + d)), from, to, k);
        }
        expected += std::norm(pressure) / 3;
      }
      EXPECT_NEAR(level_db(static_cast<double>(power[b])), level_db(expected), 0.5)
          << b << " at " << to.y;
    }
  }
}

// A wall of this thickness below y = 0, of quads that share no corners.
Mesh thick_wall(double thickness_m) {
  const auto h = static_cast<float>(thickness_m / 2);
  constexpr float kFar = 300;
  Mesh mesh;
  testing::add_quad(mesh, {Vec3f(-h, 0, -kFar), Vec3f(-h, 0, kFar), Vec3f(-h, -kFar, kFar),
                           Vec3f(-h, -kFar, -kFar)});
  testing::add_quad(
      mesh, {Vec3f(h, 0, -kFar), Vec3f(h, 0, kFar), Vec3f(h, -kFar, kFar), Vec3f(h, -kFar, -kFar)});
  testing::add_quad(
      mesh, {Vec3f(-h, 0, -kFar), Vec3f(-h, 0, kFar), Vec3f(h, 0, kFar), Vec3f(h, 0, -kFar)});
  return mesh;
}

// To waves of more than twice its thickness, a wall is a sheet.
TEST(DirectSound, BehindAThinWallIsThatBehindASheet) {
  const OcclusionGeometry wall(thick_wall(0.1), std::vector<Material>(1));
  for (const double y : {0.5, 0.1, -0.3, -1.0, -2.0}) {
    const Vec3 from(-3, y, 0.3), to(2, y, -0.2);
    const Bands power = heard(wall, from, to).visibility;
    for (std::size_t b = 0; b < 5; ++b)
      EXPECT_NEAR(level_db(static_cast<double>(power[b])),
                  level_db(testing::exact_power(from, to, b)), 1)
          << b << " at " << y;
  }
}

// Two corners in a row attenuate more than one, the more so the farther apart they are.
TEST(DirectSound, PassesTwoCornersOfAThickWall) {
  const Vec3 from(-3, -1, 0.3), to(2, -1, -0.2);
  Bands last = heard(OcclusionGeometry(testing::half_plane(), std::vector<Material>(1)), from, to)
                   .visibility;
  for (const double thickness_m : {0.3, 0.6, 0.99}) {
    const OcclusionGeometry wall(thick_wall(thickness_m), std::vector<Material>(1));
    const Bands power = heard(wall, from, to).visibility;
    for (std::size_t b = 5; b < kBandCount; ++b) {
      EXPECT_LT(power[b], last[b]) << b << " at " << thickness_m;
      EXPECT_GT(power[b], 0.02f * last[b]) << b << " at " << thickness_m;
    }
    const Bands reversed = heard(wall, to, from).visibility;
    for (std::size_t b = 0; b < kBandCount; ++b) EXPECT_NEAR(reversed[b], power[b], 1e-3) << b;
    last = power;
  }
}

TEST(DirectSound, ChangesSmoothlyOnAWalkAcrossTheShadowsOfAThickWall) {
  for (const double thickness_m : {0.05, 0.2, 0.8}) {
    const OcclusionGeometry wall(thick_wall(thickness_m), std::vector<Material>(1));
    Bands last{};
    for (double y = 2; y > -3; y -= 0.02) {
      const Bands power = heard(wall, {-3, -0.5, 0.3}, {2, y, -0.2}).visibility;
      if (y < 2) {
        EXPECT_LT(step_db(power, last), 1.2) << y << " behind " << thickness_m;
      }
      last = power;
    }
  }
}

// The wall between the rooms is 10 cm thick, and the door is in its middle.
TEST(DirectSound, ChangesSmoothlyOnAWalkThroughADoor) {
  const Level level = testing::two_rooms(true);
  const OcclusionGeometry geometry(level.mesh, level.materials);
  Bands last{};
  for (double x = 3; x < 7; x += 0.02) {
    const Bands power = heard(geometry, {1.5, 1.2, 1.5}, {x, 2.02, 1.6}).visibility;
    if (x > 3) {
      EXPECT_LT(step_db(power, last), 1) << x;
    }
    last = power;
  }
}

TEST(DirectSound, IsHeardFromTheEdgeAndAsLateAsItsWayIsLong) {
  const OcclusionGeometry geometry(testing::half_plane(), std::vector<Material>(1));
  const Vec3 from(-3, -2, 0), to(2, -2, 0), edge(0);
  const DirectSound direct = heard(geometry, from, to);
  ASSERT_TRUE(direct.bent);
  const Vec3 heard_at_m(direct.bent->heard_at_m);
  EXPECT_NEAR(length(heard_at_m - to), length(edge - from) + length(edge - to), 1e-3);
  EXPECT_GT(dot(normalize(heard_at_m - to), normalize(edge - to)), 0.9999);
  EXPECT_GT(dot(Vec3(direct.bent->leaves), normalize(edge - from)), 0.9999);
  EXPECT_FALSE(heard(geometry, from, {2, 3, 0}).bent);
}

TEST(DirectSound, PassesNoClosedDoor) {
  const Level level = testing::two_rooms(true);
  OcclusionGeometry geometry(level.mesh, level.materials);
  MovingParts parts;
  PartScene scene;
  geometry.set_parts(&scene);
  const auto shape = PartShape::make(testing::door_leaf(), level.materials);
  ASSERT_TRUE(shape.ok());
  const auto door = parts.add(*shape, testing::door_pose(0));
  ASSERT_TRUE(door.ok());
  const auto at = [&](double open_deg) {
    EXPECT_TRUE(parts.move(*door, testing::door_pose(open_deg)).ok());
    scene.update(parts);
    return heard(geometry, {2, 2, 1.5}, {8, 2.1, 1.5}).visibility;
  };
  EXPECT_EQ(at(0), Bands{});
  EXPECT_GT(at(20)[0], 0.01f);
  Bands last = at(25);
  for (double open_deg = 26.8; open_deg <= 90; open_deg += 1.8) {
    const Bands power = at(open_deg);
    EXPECT_LT(step_db(power, last), 3) << open_deg;  // of a door that opens in a second
    last = power;
  }
  EXPECT_GT(last[4], 0.7f);
}

// A door frame of quads whose corners do not meet is the same as one whose corners do.
TEST(DiffractingEdges, AreTheSameHoweverTheFacesAreDivided) {
  const auto wall = [](bool is_divided) {
    Mesh mesh;
    const auto quad = [&](float y0, float y1, float z0, float z1) {
      testing::add_quad(mesh,
                        {Vec3f(0, y0, z0), Vec3f(0, y1, z0), Vec3f(0, y1, z1), Vec3f(0, y0, z1)});
    };
    quad(-9, -0.5f, 0, 9);
    if (is_divided) {
      quad(0.5f, 9, 0, 2);
      quad(0.5f, 9, 2, 9);
    } else {
      quad(0.5f, 9, 0, 9);
    }
    quad(-0.5f, 0.5f, 2, 9);
    return mesh;
  };
  const OcclusionGeometry whole(wall(false), std::vector<Material>(1));
  const OcclusionGeometry divided(wall(true), std::vector<Material>(1));
  const Bands a = heard(whole, {-3, 0.2, 1.2}, {2, -1, 1.5}).visibility;
  const Bands b = heard(divided, {-3, 0.2, 1.2}, {2, -1, 1.5}).visibility;
  for (std::size_t band = 0; band < kBandCount; ++band) EXPECT_NEAR(a[band], b[band], 1e-4) << band;
  // Of 2 x 1 m: two jambs and a lintel, and the outer borders.
  EXPECT_EQ(DiffractingEdges(wall(false)).size(), DiffractingEdges(wall(true)).size() - 1);
}

TEST(DiffractingEdges, AreNoneInAClosedRoomAndTwelveOnABox) {
  EXPECT_EQ(DiffractingEdges(testing::box({5, 4, 3})).size(), 12u);  // seen from outside
  Mesh room = testing::box({5, 4, 3});
  const OcclusionGeometry geometry(room, std::vector<Material>(1));
  EXPECT_EQ(heard(geometry, {1, 1, 1}, {4, 3, 2}).visibility, same_in_all_bands(1));
}

}  // namespace
}  // namespace clamor
