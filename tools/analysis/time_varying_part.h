// time_varying_part.h: the part of a rendering that no fixed filter makes of the dry signal.
//
// A room with a listener who stands still is a linear time-invariant system: its output is the dry
// signal through one filter. An approximation whose choice of sources follows the music is not, and
// is heard as a room that changes with the sound. The measure is the energy that the best filter
// leaves, relative to the energy of the rendering:
//
//   min over h of  sum_n |y[n] - (h * x)[n]|^2  /  sum_n |y[n]|^2,
//
// x the dry signal, y the rendering, h a causal impulse response of L samples. n runs over samples
// whose L predecessors in x are known, so neither end needs an assumption. L independent weights
// also fit a share L / n of any other signal, for which the result is corrected.
//
// The least squares problem is solved by conjugate gradients on the normal equations (M. R.
// Hestenes, E. Stiefel. Methods of Conjugate Gradients for Solving Linear Systems. J. Res. NBS 49,
// 1952), with products by Fourier transform, preconditioned with the power spectrum of x (R. H.
// Chan, M. K. Ng. Conjugate Gradient Methods for Toeplitz Systems. SIAM Review 38, 1996).
//
// The floor, which an exact rendering leaves, is the decay of the room beyond L and what changes
// between keyframes.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "formats/audio/audio_file.h"

namespace clamor {

inline constexpr double kFixedFilter_s = 1.25;

// Minimum length of a sound, so that the filter cannot fit it sample by sample.
inline constexpr double kMinSoundForFilter_s = 4 * kFixedFilter_s;

// In decibels, at least -60, for each channel of a rendering of one or two channels. `dry` is
// extended with silence to the length of the rendering or cut. No value if either is silent or
// shorter than kMinSoundForFilter_s. Takes about as long as the sound.
std::array<std::optional<double>, 2> time_varying_part_db(std::span<const float> dry,
                                                          const Sound& rendering,
                                                          double filter_s = kFixedFilter_s);

}  // namespace clamor
