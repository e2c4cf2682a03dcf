// octave_filter.h: octave bands without phase, for work that is done offline.
//
// The only filter here is a Butterworth low-pass of order n run forward and backward: its phase
// cancels and its amplitude is 1 / (1 + (w / w_e)^2n), w = tan(pi f / rate) being the frequency as
// the bilinear transform sees it. Everything else is sums and differences of it, so splits add back
// to what was split exactly.
//
// Two sets of bands are made:
//
// * The bands of the mixer (kBandEdges_hz): M_b = L_{b+1} - L_b with n = 4, L_0 = 0 and L_8 = 1.
// They
//   sum to one; the lowest reaches down to 0 Hz and the highest up to half the rate.
// * The bands of a measurement: octaves that end below 63 Hz and above 8 kHz as well, within the
//   limits of IEC 61260-1 class 1 up to two octaves off, n = 6.
//
// A filter rings. The octave of centre f spreads a pulse over about +- 1.4 / f seconds (63 Hz: 23
// ms), before as well as after; decays much faster than that are the filter's, not the room's.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/bands.h"

namespace clamor {

// Where one band of the mixer hands over to the next: geometric means of the centres.
double band_edge_hz(std::size_t below, std::size_t above);

// One signal per band, all of one length, each weighed with its band's M_b and added up. Signals
// that are alike in all bands come back as they are. At kSampleRate_hz.
std::vector<double> sum_of_bands(const std::array<std::vector<double>, kBandCount>& bands);

// What of `signal` lies in the measurement's octave `band`, with kOctaveRing samples more at either
// end for what rings beyond. At kSampleRate_hz.
inline constexpr std::size_t kOctaveRing = 12000;
std::vector<double> octave_of(std::span<const double> signal, std::size_t band);

// Its amplitude at a frequency below half the rate, the closed form.
double octave_gain(std::size_t band, double frequency_hz);

// Width of the measurement's octave `band`.
double octave_width_hz(std::size_t band);

}  // namespace clamor
