// echo_density.h: echo density of a response: separate echoes or a smooth tail.
//
// The fraction of samples beyond one standard deviation within 20 ms under a Hann window w (sum 1),
// divided by that of Gaussian noise:
//
//     density = sum of w [|h| > sigma] / erfc(1 / sqrt 2),     sigma^2 = sum of w h^2.
//
// A few echoes give nearly 0, a late tail gives 1. J. S. Abel, P. Huang. A Simple, Robust Measure
// of Reverberation Echo Density. AES 121, 2006. In an octave the ringing of the filter counts too,
// so use 500 Hz and higher, where it is short compared with 20 ms.
//
// No just-noticeable difference is published; 0.1 is this project's bound. (At least 1554 arrivals
// per second sound smooth: J. Roberts et al., DAFx 2023.)
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace clamor {

inline constexpr double kEchoDensityHop_s = 0.005;

// Densities around samples first, first + hop, ...; 0 if the window is silent.
std::vector<double> echo_density(std::span<const double> response, std::size_t first);

}  // namespace clamor
