// echo_density.h: whether a response is a string of echoes or smooth.
//
// Within 20 ms under a Hann window w (sum 1), the share of samples that lie beyond one standard
// deviation, over the share that Gaussian noise has:
//
//     density = sum of w [|h| > sigma] / erfc(1 / sqrt 2),     sigma^2 = sum of w h^2.
//
// A few echoes are nearly 0, a late tail is 1. J. S. Abel, P. Huang. A Simple, Robust Measure of
// Reverberation Echo Density. AES 121, 2006. In an octave it is the octave's own ringing that is
// counted, so take 500 Hz and higher, where it is short against 20 ms.
//
// No just-noticeable difference is published; 0.1 is this project's bound. (At least 1554 arrivals
// a second sound smooth: J. Roberts et al., DAFx 2023.)
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace clamor {

inline constexpr double kEchoDensityHop_s = 0.005;

// Densities round the samples first, first + hop, ...; 0 where the window is silent.
std::vector<double> echo_density(std::span<const double> response, std::size_t first);

}  // namespace clamor
