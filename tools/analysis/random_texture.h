// random_texture.h: resynthesises a sound as random noise with the same texture.
//
// The sum of many sounds with random phases is Gaussian noise, which its power per frequency, time
// and pair of ears describes completely. That power is estimated from the recording, in frames of
// 43 ms, averaged over the neighbouring frames and over an ERB (at least 5 bins). Each roll then
// draws new Gaussian noise of that power. Level, spectrum, slow envelope and interaural coherence
// are preserved; waveforms and momentary fluctuations are new. Speech and music are no textures and
// do not survive; null_distribution.h discusses textures of few signals.
//
// Two rolls differ as two exact renderings do. A roll and the recording differ by less, because the
// estimate contains the recording's own fluctuations; so compare rolls with each other.
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include "formats/audio/audio_file.h"

namespace clamor {

class RandomTexture {
 public:
  explicit RandomTexture(const Sound& sound);

  // Has the length and the channels of the sound. Deterministic in seed and roll.
  Sound roll(std::uint64_t seed, std::uint32_t roll) const;

 private:
  // Per frame and bin: left = first x, right = along x + second y, for unit Gaussians x and y.
  struct Shape {
    float first = 0;
    std::complex<float> along = 0;
    float second = 0;
  };

  std::size_t frames_ = 0, channels_ = 0;
  std::vector<Shape> shapes_;
};

}  // namespace clamor
