// time_varying_part.h: how much of a rendering no fixed filter makes of the dry signal.
//
// A room with a listener who stands still is a linear time-invariant system: what is heard is the
// dry signal through one filter. An approximation whose choice of sources follows the music is no
// such system, and is heard as a room that changes with what is played. The measure is the energy
// that the best filter leaves, as a share of the energy of the rendering:
//
//   min over h of  sum_n |y[n] - (h * x)[n]|^2  /  sum_n |y[n]|^2,
//
// x the dry signal, y the rendering, h a causal impulse response of L samples. n runs over the
// samples whose L predecessors in x are known, so neither end needs an assumption. L independent
// weights also fit a share L / n of whatever is not the filter's, which is put back.
//
// The least squares are solved by conjugate gradients on the normal equations (M. R. Hestenes, E.
// Stiefel. Methods of Conjugate Gradients for Solving Linear Systems. J. Res. NBS 49, 1952), each
// product by Fourier transform, preconditioned with the power spectrum of x (R. H. Chan, M. K. Ng.
// Conjugate Gradient Methods for Toeplitz Systems. SIAM Review 38, 1996).
//
// The floor, what an exact rendering leaves, is the decay of the room beyond L and what moves
// between keyframes.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "formats/audio/audio_file.h"

namespace clamor {

inline constexpr double kFixedFilter_s = 1.25;

// Sounds are at least this long, so that the filter cannot fit them sample by sample.
inline constexpr double kMinSoundForFilter_s = 4 * kFixedFilter_s;

// In decibels, -60 at least, for each channel of a rendering of one or two channels. `dry` is as
// long as the rendering; samples that either does not have are silent. Nothing where either is
// silent, or shorter than kMinSoundForFilter_s. Takes about as long
// as the sound.
std::array<std::optional<double>, 2> time_varying_part_db(std::span<const float> dry,
                                                          const Sound& rendering,
                                                          double filter_s = kFixedFilter_s);

}  // namespace clamor
