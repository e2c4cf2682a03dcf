// loudness.h: weight of each octave band in the loudness.
#pragma once

#include "common/bands.h"

namespace clamor {

// |H|^2 of the K-weighting filter of ITU-R BS.1770-4 (annex 1, tables 1 and 2, at 48 kHz) at the
// band centres: -3 dB at 63 Hz and +3 dB at 4 kHz, relative to 1 kHz. Only ratios matter.
Bands loudness_weights();

}  // namespace clamor
