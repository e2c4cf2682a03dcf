// loudness.h: how much each octave band counts towards loudness.
#pragma once

#include "common/bands.h"

namespace clamor {

// |H|^2 of the K-weighting filter of ITU-R BS.1770-4 (annex 1, tables 1 and 2, at 48 kHz) at the
// band centres: 63 Hz counts -3 dB against 1 kHz, 4 kHz +3 dB. Relative; only ratios matter.
Bands loudness_weights();

}  // namespace clamor
