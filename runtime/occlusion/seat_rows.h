// seat_rows.h: what rows of seats do to sound that passes over them (the seat-dip effect).
//
// To long waves, the gaps between rows are wells side by side whose air moves up and down. Their
// mouths, a plane at the seats' tops, react locally. With depth d, absorption a of the material and
// k the wave number, their admittance, relative to that of air, is
//
//   beta = (1 - e) / (1 + e),   e = sqrt(1 - a) exp(2 i k d),
//
// so that sound at normal incidence loses the share a. Source and listener have images in the
// plane. Sound by way of the image, c the cosine of its angle of incidence and r its path, has
//
//   Q = R + (1 - R) F(w),   R = (c - beta) / (c + beta),   w = sqrt(i k r / 2) (c + beta),
//   F(w) = 1 + i sqrt(pi) w exp(-w^2) erfc(-i w)
//
// times the pressure of a mirror's image, and sqrt(1 - s) of that where the material scatters s.
// At grazing incidence R approaches -1, and cancels the straight sound, the most where d is a
// quarter of the wave and beta has no upper bound. |R| is at most 1 for every angle, and all of it
// depends on both ends in the same way, so that it conserves energy and is reciprocal.
//
// (T. J. Schultz, B. G. Watters. Propagation of Sound across Audience Seating. J. Acoust. Soc. Am.
// 36(5), 1964; G. M. Sessler, J. E. West. Sound Transmission over Theatre Seats. J. Acoust. Soc.
// Am. 36(9), 1964. Q over a locally reacting plane: U. Ingard. J. Acoust. Soc. Am. 23(3), 1951.)
//
// Where the distance between rows is more than half of the wave, they scatter to other directions
// as well, which the material's scattering tells. Rows count up to kFar_m below the listener or the
// source, fading from half of that on; of images, only those below the listener. Photons do not
// know of rows: late sound, and sound far above, is reflected by absorption and scattering alone.
//
// Threads: any.   Cost: nothing in a level without rows; up to 20 rays for a direct sound or image.
#pragma once

#include <complex>
#include <cstdint>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/mirror_path.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

struct Material;

// Q at a frequency in a band.
std::complex<double> reflection_of_rows(const Material& material, std::size_t band,
                                        double wave_number, double cos_i, double path_m);

// Factors of the power per band of sound that comes straight from `from`, or from its image, to
// `place_m`, by the rows below these two. 0 for the image in these rows themselves: they are part
// of the sound that they reflect. Adds the rays cast to `rays`.
Bands power_over_rows(const OcclusionGeometry& geometry, const PathEnd& from, const Vec3& place_m,
                      double speed_of_sound_mps, std::uint64_t& rays);

}  // namespace clamor
