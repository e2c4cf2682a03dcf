// voice.h: a human voice by formant synthesis: glottal pulses and breath through a vocal tract.
//
// The source is Klatt's: an opening and closing polynomial pulse, each period a little unlike the
// last (jitter, shimmer), breath that comes through the open glottis, hiss made at the teeth. The
// tract is a cascade of ten formants, the lower five moving from vowel to vowel.
//
// Dennis H. Klatt, Laura C. Klatt. Analysis, synthesis, and perception of voice quality variations
// among female and male talkers. JASA 87(2), 1990. Vowels: G. E. Peterson, H. L. Barney. Control
// methods used in a study of the vowels. JASA 24(2), 1952.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "sound.h"

namespace clamor::assets {

struct Vowel {
  std::array<double, 3> formants_hz;  // of a man
};
inline constexpr Vowel kA{{730, 1090, 2440}}, kE{{530, 1840, 2480}}, kI{{270, 2290, 3010}},
    kO{{500, 850, 2410}}, kU{{310, 780, 2240}}, kL{{360, 1250, 2700}}, kBilabial{{220, 720, 2200}};

struct Throat {
  double tract_scale = 1;      // of formant frequencies: 1 a man, 1.17 a woman, 1.3 a child
  double open_quotient = 0.5;  // of the glottal period; small is pressed, large is breathy
  double tilt_hz = 4000;       // above this the pulses are duller
  double breath = 0.05;        // noise from the open glottis, share of the voice
  double jitter = 0.008, shimmer = 0.05;  // from period to period
  double vibrato_cents = 0, vibrato_hz = 5.5;
  double strain = 0;  // how far the loudest passages are driven into roughness
  std::uint64_t seed = 1;
};

// The state of a voice at a moment; interpolated between moments.
struct Moment {
  double time_s;
  double f0_hz;
  Vowel vowel;
  double voice = 0;   // amplitudes, 0 to 1
  double breath = 0;  // besides what Throat::breath gives
  double hiss = 0;    // an s
};

// Moments in order of time; ends with the last.
Samples speak(const Throat& throat, std::span<const Moment> moments);

}  // namespace clamor::assets
