// seat_rows_test.cpp: sound that passes over rows of seats, against exact solutions and published
// measurements.
#include "runtime/occlusion/seat_rows.h"

#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdio>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "common/material.h"
#include "formats/bake_file/image_source.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/visibility_estimate.h"
#include "tests/box_mesh.h"
#include "tests/physics/boundary_elements.h"

namespace clamor {
namespace {

using std::numbers::pi;
using RowsPressure = std::complex<double>;

Material rows_of(double depth_m, float absorption, float scattering) {
  Material material = testing::uniform_material(absorption, scattering, kMirrorExponent);
  material.rows_m = static_cast<float>(depth_m);
  return material;
}

// Rows' tops, 40 m long and 30 m wide, at y = 0.
Mesh seating() {
  Mesh mesh;
  testing::add_quad(mesh, {Vec3f(0, 0, -15), Vec3f(0, 0, 15), Vec3f(40, 0, 15), Vec3f(40, 0, -15)});
  return mesh;
}

Bands heard_over(const Material& material, const Vec3& from_m, const Vec3& to_m) {
  const std::vector<Material> materials{material};
  const OcclusionGeometry geometry(seating(), materials);
  Source source;
  source.position_m = Vec3f(from_m);
  source.is_emitter = true;
  return estimate_visibility(geometry, source, {Vec3f(from_m), Vec3f(to_m), testing::kSound_mps},
                             kMediumPaths, true)
      .diffracted;
}

double rows_db(float power) { return 10 * std::log10(static_cast<double>(power)); }

// Rigid gaps of no width between them, as deep as d, and as far apart as p: the field above is a
// sum of plane waves, that in the gaps a sum of modes (mode matching). Only the mirror's wave goes
// far where p is less than half of the wave.
RowsPressure exact_reflection(double depth_m, double period_m, double wave_number, double sin_i) {
  constexpr int kOrders = 12, kModes = 8;
  const RowsPressure up(0, 1);
  const auto vertical = [&](double along) {
    const double square = wave_number * wave_number - along * along;
    return square >= 0 ? RowsPressure(std::sqrt(square)) : RowsPressure(0, std::sqrt(-square));
  };
  // Overlap of a plane wave with a mode: the mean of exp(i a x) cos(m pi x / p) over a gap.
  const auto overlap = [&](double along, int mode) {
    RowsPressure sum = 0;
    for (const double sign : {1.0, -1.0}) {
      const double turn = (along + sign * mode * pi / period_m) * period_m;
      sum += 0.5 *
             (std::abs(turn) < 1e-9 ? RowsPressure(1) : (std::exp(up * turn) - 1.0) / (up * turn));
    }
    return sum;
  };
  // Unknown: the modes' pressures at the mouth, q. Their velocities and pressures are continuous.
  std::vector<RowsPressure> matrix(kModes * kModes), right(kModes);
  const double along_0 = wave_number * sin_i;
  const RowsPressure down_0 = vertical(along_0);
  const auto flow = [&](int mode) {  // of a mode, per pressure at the mouth
    const RowsPressure deep = vertical(mode * pi / period_m);
    return -up * deep * std::tan(deep * depth_m);
  };
  for (int m = 0; m < kModes; ++m) {
    const double norm = m == 0 ? 1 : 0.5;
    right[static_cast<std::size_t>(m)] = 2.0 * overlap(along_0, m);
    for (int j = 0; j < kModes; ++j) {
      RowsPressure sum = m == j ? norm : 0.0;
      for (int n = -kOrders; n <= kOrders; ++n) {
        const double along = along_0 + 2 * pi * n / period_m;
        sum += overlap(along, m) * std::conj(overlap(along, j)) * flow(j) / vertical(along);
      }
      matrix[static_cast<std::size_t>(m * kModes + j)] = sum;
    }
  }
  const std::vector<RowsPressure> modes = testing::solve(std::move(matrix), std::move(right));
  RowsPressure reflected = 1;
  for (int j = 0; j < kModes; ++j)
    reflected -=
        std::conj(overlap(along_0, j)) * flow(j) * modes[static_cast<std::size_t>(j)] / down_0;
  return reflected;
}

TEST(SeatRows, ReflectAsTheExactSolutionOfRigidGapsBelowHalfAWaveApart) {
  const Material rigid = rows_of(0.8, 0, 0);
  for (const double period_m : {0.3, 0.9})
    for (const double hz : {40.0, 63.0, 80.0, 125.0, 160.0})
      for (const double deg : {30.0, 60.0, 80.0, 87.0}) {
        const double k = 2 * pi * hz / testing::kSound_mps, angle = deg * pi / 180;
        const RowsPressure exact = exact_reflection(0.8, period_m, k, std::sin(angle));
        // Far away, the spherical wave is a plane one.
        const RowsPressure ours = reflection_of_rows(rigid, 1, k, std::cos(angle), 1e9);
        EXPECT_NEAR(std::abs(exact), 1, 1e-3) << hz << " Hz, " << deg << " degrees";
        EXPECT_LT(std::abs(ours - exact), period_m < 0.5 ? 0.1 : 0.2)
            << hz << " Hz, " << deg << " degrees, " << period_m << " m: " << std::arg(ours)
            << " for " << std::arg(exact);
      }
}

TEST(SeatRows, ReflectNeverMoreThanArrives) {
  for (const float absorption : {0.0f, 0.3f, 1.0f})
    for (double hz = 20; hz < 12'000; hz *= 1.1)
      for (double cos_i = 0.001; cos_i <= 1; cos_i *= 1.3)
        EXPECT_LT(std::abs(reflection_of_rows(rows_of(0.8, absorption, 0), 3,
                                              2 * pi * hz / testing::kSound_mps, cos_i, 1e12)),
                  1 + 1e-9)
            << hz << " Hz, " << cos_i;
}

TEST(SeatRows, ThatAreShallowAndRigidReflectAsAFloor) {
  // In low bands, the floor's sound arrives in phase.
  const Bands power = heard_over(rows_of(0.001, 0, 0), {2, 1, 0}, {18, 0.4, 0});
  EXPECT_NEAR(rows_db(power[0]), 6.02, 0.05);
  EXPECT_NEAR(rows_db(power[1]), 6.02, 0.1);
}

// Measured over seats at grazing incidence: dips of 10 to 20 dB between 80 and 300 Hz (T. J.
// Schultz, B. G. Watters. J. Acoust. Soc. Am. 36(5), 1964; G. M. Sessler, J. E. West. J. Acoust.
// Soc. Am. 36(9), 1964; D. Greenberg, C. Burroughs. J. Acoust. Soc. Am. 96, 1994), less attenuation
// up to 1 kHz, hardly changed by the seats' absorption, less under higher sources, and lower in
// frequency over deeper gaps (H. Tahvanainen and others. Acta Acustica 4(4), 2020).
TEST(SeatRows, AttenuateLowSoundAtGrazingIncidenceAsMeasured) {
  const auto over = [](double depth_m, float absorption, double source_m) {
    const Bands power =
        heard_over(rows_of(depth_m, absorption, 0.1f), {1, source_m, 0}, {16, 0.35, 0});
    std::array<double, kBandCount> db{};
    for (std::size_t b = 0; b < kBandCount; ++b) db[b] = rows_db(power[b]);
    return db;
  };
  const auto power_db = over(0.8, 0.3f, 1);
  std::printf("| over seats, dB |");
  for (const double db : power_db) std::printf(" %.1f |", db);
  std::printf("\n");
  EXPECT_NEAR(power_db[1], -15, 5);  // 125 Hz
  EXPECT_NEAR(power_db[2], -6, 3);
  EXPECT_LT(power_db[3], -1);
  EXPECT_NEAR(over(0.8, 0.6f, 1)[1], power_db[1], 3);
  EXPECT_GT(over(0.8, 0.3f, 5)[1], power_db[1] + 5);
  EXPECT_LT(over(0.4, 0.3f, 1)[2], power_db[2]);
  EXPECT_GT(over(0.4, 0.3f, 1)[0], power_db[0]);
}

TEST(SeatRows, ChangeNothingWhereThereAreNone) {
  Material floor = rows_of(0.8, 0.3f, 0.1f);
  floor.rows_m = 0;
  EXPECT_EQ(heard_over(floor, {1, 1, 0}, {16, 0.35, 0}), same_in_all_bands(1));
  // Far above the rows.
  EXPECT_EQ(heard_over(rows_of(0.8, 0.3f, 0.1f), {1, 6, 0}, {16, 5, 0}), same_in_all_bands(1));
}

TEST(SeatRows, AreHeardAlikeFromBothEnds) {
  for (const double deg : {0.0, 30.0})
    for (const double height_m : {0.35, 1.0, 2.5, 6.0}) {
      const Vec3 a_m(3, height_m, 0), b_m(18, 0.4, 15 * std::tan(deg * pi / 180));
      const Material rows = rows_of(0.8, 0.3f, 0.1f);
      const Bands there = heard_over(rows, a_m, b_m), back = heard_over(rows, b_m, a_m);
      for (std::size_t b = 0; b < kBandCount; ++b)
        EXPECT_NEAR(rows_db(there[b]), rows_db(back[b]), 1e-3) << height_m << " m, band " << b;
    }
}

// At the end of the seating, and far above, the effect fades.
TEST(SeatRows, ComeInGraduallyOnAWalk) {
  const Material rows = rows_of(0.8, 0.3f, 0.1f);
  Bands last = heard_over(rows, {1, 1, 0}, {3, 0.4, 0});
  for (double x = 3; x < 38; x += 0.05) {
    const Bands now = heard_over(rows, {1, 1, 0}, {x, 0.4, 0});
    for (std::size_t b = 0; b < 4; ++b) EXPECT_NEAR(rows_db(now[b]), rows_db(last[b]), 1.5) << x;
    last = now;
  }
}

}  // namespace
}  // namespace clamor
