// binaural_cues.h: what tells the ears where a sound comes from and how wide it is, per octave.
//
//   ILD   level of the right ear above the left, dB
//   ITD   how much later the right ear hears it, seconds, so positive for sound from the left:
//   where
//         the interaural cross-correlation has its maximum within +- 1 ms
//   IACC  the greatest magnitude of that function, 0 to 1:
//
//         IACF(t) = int l(s) r(s + t) ds / sqrt(int l^2 ds int r^2 ds),   IACC = max |IACF|, |t| <
//         1 ms
//
// ISO 3382-1:2009, annex B. Over the whole sound, so of a listener who stands still. The octaves
// are those of a measurement (octave_filter.h), applied to the cross-spectrum, which gives the
// function at any lag without a filter or an interpolation.
//
// Just noticeable: ILD 0.5 to 1 dB (W. A. Yost, R. H. Dye, J. Acoust. Soc. Am. 83, 1988); ITD 10 us
// at best (R. G. Klumpp, H. R. Eady, J. Acoust. Soc. Am. 28, 1956) and 0.05 rad of phase below
// that, nothing above 1.5 kHz, where the ear no longer follows the wave; IACC 0.075 (ISO 3382-1).
#pragma once

#include <array>
#include <optional>

#include "common/bands.h"
#include "tools/analysis/sound_spectrum.h"

namespace clamor {

struct BinauralCues {
  using Value = std::array<std::optional<double>, kBandCount>;
  // ILD is kept within 60 dB and left out in a band 60 dB below the loudest; the other two are left
  // out where either ear is silent as well, ITD also where IACC is below 0.3: it tells no
  // direction.
  Value ild_db, itd_s, iacc;
};

inline constexpr double kMinIaccForItd = 0.3;

// Of a sound in stereo; in mono there is none.
BinauralCues binaural_cues(const SoundSpectrum& spectrum);

}  // namespace clamor
