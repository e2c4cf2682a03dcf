// half_plane_reference.h: the exact field behind a rigid half-plane.
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
#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

#include "common/vec.h"
#include "formats/level/mesh.h"

namespace clamor::testing {

using Complex = std::complex<double>;
inline constexpr double kSound_mps = 343.2, kPi = std::numbers::pi;

// Hankel's asymptotic series with five terms; the error is 1e-3 at |z| = 3.
inline Complex hankel1(Complex z) {
  const Complex i(0, 1);
  constexpr double kTerms[] = {3.0 / 8, -15.0 / 128, 315.0 / 3072, -14175.0 / 98304};
  Complex sum = 1, power = 1;
  for (const double term : kTerms) {
    power *= i / z;
    sum += term * power;
  }
  return std::sqrt(2.0 / (kPi * z)) * std::exp(i * (z - 3 * kPi / 4)) * sum;
}

inline Complex integral_from(double x, double start) {  // start >= 0
  const Complex turn = std::polar(1.0, kPi / 4);
  constexpr double kStep = 0.02, kEnd = 5;
  Complex sum = 0;
  for (double s = kStep / 2; s < kEnd; s += kStep) {
    const Complex m = start + s * turn;
    sum += hankel1(x + m * m) / std::sqrt(2 * x + m * m);
  }
  return sum * kStep * turn;
}

inline Complex macdonald(double x, double xi) {
  const Complex whole = 2.0 * integral_from(x, 0);
  return xi <= 0 ? integral_from(x, -xi) / whole : 1.0 - integral_from(x, xi) / whole;
}

// Pressure of the half-plane x = 0, y < 0 with a source at x < 0, at a wave number.
inline Complex exact_pressure(const Vec3& from_m, const Vec3& to_m, double k) {
  const auto angle = [](const Vec3& at) {  // from the half-plane, on the source's side
    const double phi = std::atan2(-at.x, -at.y);
    return phi < 0 ? phi + 2 * kPi : phi;
  };
  const double r0 = std::hypot(from_m.x, from_m.y), r = std::hypot(to_m.x, to_m.y);
  const double direct_m = length(to_m - from_m);
  const double image_m = length(to_m - Vec3(-from_m.x, from_m.y, from_m.z));
  const double round_m = std::hypot(r + r0, to_m.z - from_m.z);
  const auto radiation = [&](double distance_m, double phi) {
    const double xi = 2 * std::sqrt(k * r * r0 / (round_m + distance_m)) * std::cos(phi / 2);
    return std::polar(1 / distance_m, k * distance_m) * macdonald(k * distance_m, xi);
  };
  return radiation(direct_m, angle(to_m) - angle(from_m)) +
         radiation(image_m, angle(to_m) + angle(from_m));
}

// Power of the exact field, relative to a free field, averaged over an octave.
inline double exact_power(const Vec3& from_m, const Vec3& to_m, std::size_t band) {
  const double direct_m = length(to_m - from_m);
  constexpr int kSteps = 6;
  double power = 0;
  for (int step = 0; step < kSteps; ++step) {
    const double hz = 1000 * std::exp2(static_cast<double>(band) - 4.5 + (step + 0.5) / kSteps);
    power += std::norm(exact_pressure(from_m, to_m, 2 * kPi * hz / kSound_mps));
  }
  return power / kSteps * direct_m * direct_m;
}

// A sheet at x = 0, y < 0, so large that only one edge matters.
inline Mesh half_plane() {
  Mesh mesh;
  mesh.vertices_m = {{0, 0, -1000}, {0, 0, 1000}, {0, -1000, 1000}, {0, -1000, -1000}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.materials = {0, 0};
  return mesh;
}

}  // namespace clamor::testing
