#include "tools/analysis/sound_spectrum.h"

#include <cassert>

#include "common/fourier.h"
#include "common/sample_rate.h"
#include "tools/analysis/hann_window.h"

namespace clamor {

namespace {

constexpr std::size_t kHop = kSpectrumFrame / 4;
constexpr double kSumOfSquares = 1.5;  // of the squared windows over any sample: 4 x 3 / 8

}  // namespace

double spectrum_bin_hz(double bin) { return bin * kSampleRate_hz / kSpectrumFrame; }

SoundSpectrum sound_spectrum(const Sound& sound) {
  const bool stereo = sound.channels.size() == 2;
  assert(stereo || sound.channels.size() == 1);
  const Fourier fourier(kSpectrumFrame);
  const std::vector<double> window = hann_window(kSpectrumFrame, kSpectrumFrame);

  SoundSpectrum spectrum;
  spectrum.energy[0].assign(kSpectrumBins, 0);
  if (stereo) {
    spectrum.energy[1].assign(kSpectrumBins, 0);
    spectrum.cross.assign(kSpectrumBins, 0);
  }
  std::vector<std::complex<double>> values(kSpectrumFrame);
  const std::size_t frames = sound.frames();
  // `end` is where a frame ends. The first and the last frames extend beyond the sound.
  for (std::size_t end = kHop; end < frames + kSpectrumFrame; end += kHop) {
    for (std::size_t i = 0; i < kSpectrumFrame; ++i) {
      const std::size_t at = end + i - kSpectrumFrame;  // wraps round before the sound
      values[i] = 0;
      if (at < frames)
        values[i] = {window[i] * sound.channels[0][at],
                     stereo ? window[i] * sound.channels[1][at] : 0};
    }
    // Two real signals in one transform: left is the even part, right the odd.
    fourier.forward(values);
    for (std::size_t k = 0; k < kSpectrumBins; ++k) {
      const std::complex<double> z = values[k];
      const std::complex<double> mirror = std::conj(values[(kSpectrumFrame - k) % kSpectrumFrame]);
      const bool single = k == 0 || k == kSpectrumFrame / 2;
      const double scale = (single ? 1.0 : 2.0) / (4 * kSumOfSquares * kSpectrumFrame);
      const std::complex<double> left = z + mirror, difference = z - mirror;
      const std::complex<double> right(difference.imag(), -difference.real());
      spectrum.energy[0][k] += scale * std::norm(left);
      if (!stereo) continue;
      spectrum.energy[1][k] += scale * std::norm(right);
      spectrum.cross[k] +=
          scale * std::complex<double>(left.real() * right.real() + left.imag() * right.imag(),
                                       left.real() * right.imag() - left.imag() * right.real());
    }
  }
  return spectrum;
}

}  // namespace clamor
