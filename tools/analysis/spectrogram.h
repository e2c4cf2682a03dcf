// spectrogram.h: how loud a sound is in each third of an octave, over time, and a picture of that.
//
// Thirds of octaves as in IEC 61260-1 (base ten), from 31.5 Hz to 20 kHz. Frames of 16 384 samples
// (2.9 Hz a bin) under a Hann window, a quarter of a frame apart; what lies across a border is
// shared. Takes 3 ms per second of sound and pair of channels.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "formats/audio/audio_file.h"

namespace clamor {

inline constexpr int kThirdOctaves = 29;

// The middle of a third of an octave; its borders are 10^(1/20) away.
double third_octave_hz(int band);

struct Spectrogram {
  double column_s = 0;  // seconds of each column; of the last, what is left
  double length_s = 0;
  // Mean power of a column, of all channels' mean, where a full-scale square wave has 1.
  std::vector<std::array<double, kThirdOctaves>> power;
};

Spectrogram spectrogram_of(const Sound& sound, std::size_t max_columns = 200);

// 60 dB down from the loudest.
std::string to_svg(const Spectrogram& spectrogram, const std::string& title);

}  // namespace clamor
