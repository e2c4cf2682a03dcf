// octave_filter.h: zero-phase octave filters for offline use.
//
// The only filter is a Butterworth low-pass of order n run forwards and backwards. Its phase
// cancels, and its amplitude is 1 / (1 + (w / w_e)^2n), where w = tan(pi f / rate) is the frequency
// warped by the bilinear transform. All others are sums and differences of it, so splits add back
// exactly.
//
// There are two sets of bands:
//
// * The bands of the mixer (band_edge_hz()): M_b = L_{b+1} - L_b with n = 4, L_0 = 0 and L_8 = 1.
//   They sum to one; the lowest reaches down to 0 Hz and the highest up to half the rate.
// * The bands of a measurement: octaves that also end below 63 Hz and above 8 kHz, within the
//   limits of IEC 61260-1 class 1 up to two octaves off, n = 6.
//
// Filters ring. The octave of centre f spreads a pulse over about +- 1.4 / f seconds (63 Hz: 23
// ms), before and after it. Decays much faster than that are the filter's, not the room's.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/bands.h"

namespace clamor {

// The edge between two bands of the mixer: the geometric mean of their centres.
double band_edge_hz(std::size_t below, std::size_t above);

// Filters one signal per band, all of one length, with M_b and adds them up. Equal signals come
// back unchanged. At kSampleRate_hz.
std::vector<double> sum_of_bands(const std::array<std::vector<double>, kBandCount>& bands);

// `signal` filtered by the measurement's octave `band`, with kOctaveRing more samples at either end
// for the ringing. At kSampleRate_hz.
inline constexpr std::size_t kOctaveRing = 12000;
std::vector<double> octave_of(std::span<const double> signal, std::size_t band);

// Amplitude of that filter at a frequency below half the rate, in closed form.
double octave_gain(std::size_t band, double frequency_hz);

// Width of the measurement's octave `band`.
double octave_width_hz(std::size_t band);

}  // namespace clamor
