// binaural_cues.h: interaural level and time differences and interaural correlation, per octave.
//
//   ILD   level of the right ear above the left, dB
//   ITD   delay of the right ear, seconds, positive for sound from the left: the lag where the
//         interaural cross-correlation has its maximum within +- 1 ms
//   IACC  the largest magnitude of that function, 0 to 1:
//
//         IACF(t) = int l(s) r(s + t) ds / sqrt(int l^2 ds int r^2 ds),   IACC = max |IACF|, |t| <
//         1 ms
//
// ISO 3382-1:2009, annex B. Computed over the whole sound, so the listener must stand still. The
// octaves are those of a measurement (octave_filter.h), applied to the cross-spectrum, which gives
// the function at any lag without filtering or interpolation.
//
// Just-noticeable differences: ILD 0.5 to 1 dB (W. A. Yost, R. H. Dye, J. Acoust. Soc. Am. 83,
// 1988). ITD 10 us at best (R. G. Klumpp, H. R. Eady, J. Acoust. Soc. Am. 28, 1956) and 0.05 rad of
// phase at low frequencies; none above 1.5 kHz, where ears do not follow the waveform. IACC 0.075
// (ISO 3382-1).
#pragma once

#include <array>
#include <optional>

#include "common/bands.h"
#include "tools/analysis/sound_spectrum.h"

namespace clamor {

struct BinauralCues {
  using Value = std::array<std::optional<double>, kBandCount>;
  // ILD is clamped to 60 dB and missing in bands 60 dB below the loudest. The other two are missing
  // if either ear is silent as well, and ITD if IACC is below 0.3, where it gives no direction.
  Value ild_db, itd_s, iacc;
};

inline constexpr double kMinIaccForItd = 0.3;

// Needs a stereo sound; mono has no cues.
BinauralCues binaural_cues(const SoundSpectrum& spectrum);

}  // namespace clamor
