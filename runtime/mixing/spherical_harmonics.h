// spherical_harmonics.h: the real spherical harmonics to order 3 in the AmbiX convention.
//
// With x ahead, y to the left and z up, azimuth a counter-clockwise from ahead and elevation e,
//
//     Y_lm = N_lm P_l|m|(sin e) { cos |m|a for m >= 0, sin |m|a for m < 0 },
//     N_lm = sqrt((2 - [m = 0]) (l - |m|)! / (l + |m|)!),
//
// where P has no Condon-Shortley phase (-1)^m. This is the normalisation SN3D: Y_00 = 1, and the
// squares of one order add up to 1 in every direction. The channel number is l (l + 1) + m (ACN).
// Written as polynomials of x, y and z, without angles or poles.
//
// C. Nachbar, F. Zotter, E. Deleflie, A. Sontacchi. AmbiX: A Suggested Ambisonics Format.
// Ambisonics Symposium 2011.
#pragma once

#include <array>
#include <cstddef>

#include "common/vec.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

inline constexpr int kAmbisonicOrder = 3;
inline constexpr std::size_t kAmbisonicChannels = (kAmbisonicOrder + 1) * (kAmbisonicOrder + 1);

// `v` is a unit vector.
inline std::array<float, kAmbisonicChannels> spherical_harmonics(const Vec3f& v) noexcept REALTIME {
  const float x = v.x, y = v.y, z = v.z;
  constexpr float kRoot3 = 1.7320508f, kRoot6 = 2.4494897f, kRoot10 = 3.1622777f,
                  kRoot15 = 3.8729833f;
  return {1,
          y,
          z,
          x,
          kRoot3 * x * y,
          kRoot3 * y * z,
          (3 * z * z - 1) / 2,
          kRoot3 * x * z,
          kRoot3 / 2 * (x * x - y * y),
          kRoot10 / 4 * y * (3 * x * x - y * y),
          kRoot15 * x * y * z,
          kRoot6 / 4 * y * (5 * z * z - 1),
          z * (5 * z * z - 3) / 2,
          kRoot6 / 4 * x * (5 * z * z - 1),
          kRoot15 / 2 * z * (x * x - y * y),
          kRoot10 / 4 * x * (x * x - 3 * y * y)};
}

}  // namespace clamor
