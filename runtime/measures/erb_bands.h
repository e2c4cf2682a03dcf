// erb_bands.h: frequency as the ear divides it.
//
// The ear's filter at f kHz is ERB = 24.7 (4.37 f + 1) Hz wide (the rectangle of equal area and
// height); counted in such widths from 0 Hz up, f lies at number 21.4 log10(4.37 f + 1). The bands
// here are one number wide, 1 to 40, 26 Hz to 16.8 kHz.
//
// B. R. Glasberg, B. C. J. Moore. Derivation of auditory filter shapes from notched-noise data.
// Hearing Research 47, 1990.
//
// Just noticeable: 1 to 2 dB in one band (D. M. Green. Profile Analysis. 1988).
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace clamor {

inline constexpr std::size_t kErbBandCount = 39;
using ErbBands = std::array<double, kErbBandCount>;

double erb_width_hz(double frequency_hz);
double erb_number(double frequency_hz);
double erb_frequency_hz(double number);

// Middle of a band, half a number from either edge.
double erb_band_centre_hz(std::size_t band);

// Energies of the bins of a SoundSpectrum, by band; a bin that lies across an edge is divided.
ErbBands erb_spectrum(std::span<const double> energy);

}  // namespace clamor
