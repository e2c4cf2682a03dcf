// texture_statistics.h: what a crowd, rain or a fire sounds like, beyond its spectrum.
//
// Listeners tell textures apart by statistics of their envelopes in ERB bands, not by waveforms.
// Here 32 bands, 55 Hz to 8.6 kHz, each half a cosine two ERB wide; the envelope is compressed
// (power 0.3) and taken 375 times a second. Per band, of the envelope's values:
//
//   variation    standard deviation over mean: how grainy it is
//   skewness, kurtosis   whether single events stand out
//   modulation   how its power is shared among 1.5-3, 3-6, ... 94-188 Hz, in dB of the whole
//   correlation  with the band 3 ERB higher: whether the events are broad
//
// J. H. McDermott, E. P. Simoncelli. Sound Texture Perception via Statistics of the Auditory
// Periphery. Neuron 71, 2011. No just-noticeable differences are published: hold them against the
// differences of exact renderings (null_distribution.h).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace clamor {

inline constexpr std::size_t kTextureBands = 32, kModulationBands = 7, kCorrelationErbs = 3;

struct TextureStatistics {
  // Per band; modulation per band and octave. All empty for a sound below 1.5 s, which is too short
  // to have statistics; a silent band has 0 everywhere.
  std::vector<double> variation, skewness, kurtosis, modulation_db, correlation;
};

// At kSampleRate_hz. Takes 10 ms per second of sound.
TextureStatistics texture_statistics(std::span<const float> samples);

}  // namespace clamor
