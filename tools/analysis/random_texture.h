// random_texture.h: other sounds that are the same texture.
//
// The sum of many sounds with random phases is Gaussian noise whose power, per frequency, moment
// and pair of ears, is all that is left to tell of it. That power is estimated from the recording:
// in frames of 43 ms, averaged over the frame before and after and over an ERB (at least 5 bins).
// Each roll then draws new Gaussian noise of that power: level, spectrum, slow envelope and what
// the ears share are kept, all waveforms and momentary chances are new. Speech or music does not
// survive it: these are no textures; and null_distribution.h tells of textures that few signals
// make.
//
// Two rolls differ as two exact renderings do. A roll and the recording itself differ by less,
// because the chances of the recording are in the estimate; so compare rolls with each other.
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include "formats/audio/audio_file.h"

namespace clamor {

class RandomTexture {
 public:
  explicit RandomTexture(const Sound& sound);

  // As long and with as many channels as the sound; the same for the same seed and roll.
  Sound roll(std::uint64_t seed, std::uint32_t roll) const;

 private:
  // Per frame and bin: left = first x, right = along x + second y, for x and y Gaussian and unit.
  struct Shape {
    float first = 0;
    std::complex<float> along = 0;
    float second = 0;
  };

  std::size_t frames_ = 0, channels_ = 0;
  std::vector<Shape> shapes_;
};

}  // namespace clamor
