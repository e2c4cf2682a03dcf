// spectrogram.h: power per third-octave band over time.
//
// Bands are those of IEC 61260-1 (base ten), from 31.5 Hz to 20 kHz. The spectrum comes from frames
// of 16 384 samples (2.9 Hz a bin) under a Hann window, with a hop of a quarter frame; a bin that
// crosses a band edge or a column edge is shared.
//
// Cost: 3 ms per second of sound and pair of channels.
#pragma once

#include <array>
#include <vector>

#include "formats/audio/audio_file.h"

namespace clamor {

inline constexpr int kThirdOctaves = 29;

// Centre frequency of a band; its edges are a factor of 10^(1/20) away.
double third_octave_hz(int band);

struct Spectrogram {
  double column_s = 0;  // duration of each column but the last, which is shorter
  double length_s = 0;
  // Mean power of a column, averaged over channels; 1 for a full-scale square wave.
  std::vector<std::array<double, kThirdOctaves>> power;
};

Spectrogram spectrogram_of(const Sound& sound, std::size_t max_columns = 200);

}  // namespace clamor
