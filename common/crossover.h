// crossover.h: the filters that part and rejoin the octave bands, as second-order factors.
//
// Linkwitz-Riley crossovers of order 12, Butterworth 6 twice. With D the Butterworth polynomial,
//
//     low = 1 / D^2,   high = s^12 / D^2,   low + high = D(-s) / D(s),
//
// so two sides add up to a pure all-pass and are in phase at every frequency. Run forwards and
// backwards in time, one Butterworth has the same magnitude and no phase at all.
//
// The bake measures with them what the mixer will filter with them.
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

// The factors of the Butterworth low-pass, the high-pass, or the all-pass D(-s) / D(s), through the
// bilinear transform, exact at the edge.
std::array<Biquad, kButterworthFactors> crossover_factors(std::size_t edge, double rate_hz,
                                                          Side side);

// Magnitude of one side, Butterworth 6 twice: 1 or w^12 over 1 + w^12, w the ratio to the edge
// after the transform's warping.
double crossover_magnitude(std::size_t edge, double rate_hz, Side side, double frequency_hz);

// Filters in place, from the first sample to the last or from the last to the first. A loop has
// been playing for `tail` samples before; anything else starts from rest.
void filter_samples(const std::vector<Biquad>& factors, std::vector<double>& samples,
                    bool backwards, std::size_t tail);

}  // namespace clamor
