// crossover.h: the crossover filters between octave bands, as second-order sections.
//
// Linkwitz-Riley crossovers of order 12: Butterworth filters of order 6 applied twice. With D the
// Butterworth polynomial,
//
//     low = 1 / D^2,   high = s^12 / D^2,   low + high = D(-s) / D(s),
//
// so both sides sum to an all-pass and are in phase at every frequency. One Butterworth filter run
// forwards and backwards in time has the same magnitude and zero phase.
//
// The bake measures signals with the same crossovers that the mixer filters them with.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/bands.h"

namespace clamor {

struct Biquad {
  double b0 = 1, b1 = 0, b2 = 0, a1 = 0, a2 = 0;
};

inline constexpr std::size_t kBandEdges = kBandCount - 1;  // edge k: between bands k and k + 1
inline constexpr std::size_t kButterworthFactors = 3;

enum class Side { kLow, kHigh, kBoth };

// Geometric mean of the centres on both sides.
double band_edge_hz(std::size_t edge);

// Sections of the Butterworth low-pass, the high-pass or the all-pass D(-s) / D(s), by the bilinear
// transform prewarped to the edge.
std::array<Biquad, kButterworthFactors> crossover_factors(std::size_t edge, double rate_hz,
                                                          Side side);

// Magnitude of one side of the crossover: 1 or w^12 over 1 + w^12, where w is the warped frequency
// relative to the edge.
double crossover_magnitude(std::size_t edge, double rate_hz, Side side, double frequency_hz);

// Filters in place, forwards or backwards in time. A loop first runs through `tail` samples to
// settle the filters; pass 0 to start from rest.
void filter_samples(const std::vector<Biquad>& factors, std::vector<double>& samples,
                    bool backwards, std::size_t tail);

}  // namespace clamor
