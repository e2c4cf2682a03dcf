// erb_spectrum.h: the energy of a sound in the ear's frequency bands.
#pragma once

#include <span>

#include "runtime/hrtf/erb_bands.h"

namespace clamor {

// Energy per band of a SoundSpectrum's bins; a bin across an edge is divided.
ErbBands erb_spectrum(std::span<const double> energy);

}  // namespace clamor
