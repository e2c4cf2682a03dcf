// texture_statistics.h: statistics of a texture, such as a crowd, rain or a fire, beyond its
// spectrum.
//
// Listeners distinguish textures by statistics of their envelopes in ERB bands, not by waveforms.
// There are 32 bands, 55 Hz to 8.6 kHz, each half a cosine two ERB wide. The envelope is compressed
// (power 0.3) and sampled 375 times a second. Per band and over the values of the envelope:
//
//   variation    standard deviation over mean: graininess
//   skewness, kurtosis   prominence of single events
//   modulation   distribution of power over 1.5-3, 3-6, ... 94-188 Hz, in dB of the whole
//   correlation  with the band 3 ERB higher: whether events are broadband
//
// J. H. McDermott, E. P. Simoncelli. Sound Texture Perception via Statistics of the Auditory
// Periphery. Neuron 71, 2011. No just-noticeable differences are published; compare with the
// differences of exact renderings (null_distribution.h).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace clamor {

inline constexpr std::size_t kTextureBands = 32, kModulationBands = 7, kCorrelationErbs = 3;

struct TextureStatistics {
  // Per band; modulation per band and octave. All empty for a sound below 1.5 s, which is too short
  // for statistics; all 0 for a silent band.
  std::vector<double> variation, skewness, kurtosis, modulation_db, correlation;
};

// `samples` are at kSampleRate_hz. Takes 10 ms per second of sound.
TextureStatistics texture_statistics(std::span<const float> samples);

}  // namespace clamor
