// erb_bands.h: the ear's frequency bands (ERB scale).
//
// The auditory filter at f kHz has an equivalent rectangular bandwidth of ERB = 24.7 (4.37 f + 1)
// Hz. Counted in such widths from 0 Hz, f lies at number 21.4 log10(4.37 f + 1). The bands are one
// number wide, 1 to 40, 26 Hz to 16.8 kHz.
//
// B. R. Glasberg, B. C. J. Moore. Derivation of auditory filter shapes from notched-noise data.
// Hearing Research 47, 1990.
//
// Just noticeable: 1 to 2 dB in one band (D. M. Green. Profile Analysis. 1988).
#pragma once

#include <array>
#include <cstddef>

namespace clamor {

inline constexpr std::size_t kErbBandCount = 39;
using ErbBands = std::array<double, kErbBandCount>;

double erb_width_hz(double frequency_hz);
double erb_number(double frequency_hz);
double erb_frequency_hz(double number);

// Centre of a band, half a number from either edge.
double erb_band_centre_hz(std::size_t band);

}  // namespace clamor
