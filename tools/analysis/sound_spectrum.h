// sound_spectrum.h: power spectrum of a sound and the cross-spectrum of its two channels.
//
// Frames of 8192 samples (5.9 Hz a bin) under a Hann window, a quarter of a frame apart. Squared
// windows add up to a constant, so a click counts equally wherever it is, and the energies of all
// bins add up to that of the sound. (P. D. Welch. The Use of Fast Fourier Transform for the
// Estimation of Power Spectra. IEEE Trans. Audio Electroacoust. 15, 1967.)
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <vector>

#include "formats/audio/audio_file.h"

namespace clamor {

inline constexpr std::size_t kSpectrumFrame = 8192, kSpectrumBins = kSpectrumFrame / 2 + 1;

// The centre frequency of a bin, which extends half a bin to either side.
double spectrum_bin_hz(double bin);

struct SoundSpectrum {
  // Energy per bin, left and right; the sum over bins is the sum of squares of the samples. The
  // second is empty in mono.
  std::array<std::vector<double>, 2> energy;
  std::vector<std::complex<double>> cross;  // conj(left) right, likewise
};

// One or two channels. Takes 4 ms per second of sound.
SoundSpectrum sound_spectrum(const Sound& sound);

}  // namespace clamor
