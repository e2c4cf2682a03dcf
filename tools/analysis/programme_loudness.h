// programme_loudness.h: integrated and momentary loudness of a recording by BS.1770, through
// libebur128.
//
// Loudness is the K-weighted mean square of all channels: a 997 Hz sine at full scale in both ears
// is 0 LUFS, and 1 LU is 1 dB. Integrated loudness is gated, so that pauses do not count; momentary
// loudness is over 400 ms, here every 100 ms.
//
// Just noticeable: about 1 dB (E. Zwicker, H. Fastl. Psychoacoustics. 1990).
//
// ITU-R BS.1770-4, Algorithms to measure audio programme loudness, 2015; EBU R 128 and Tech 3341.
#pragma once

#include <vector>

#include "formats/audio/audio_file.h"

namespace clamor {

// The absolute gate of BS.1770: quieter sound counts as silence.
inline constexpr double kSilence_lufs = -70;
inline constexpr double kMomentaryHop_s = 0.1, kMomentaryWindow_s = 0.4;

struct ProgrammeLoudness {
  double integrated_lufs = kSilence_lufs;  // kSilence_lufs if every 400 ms lie below it
  std::vector<double> momentary_lufs;      // window i ends at (i + 4) hops; -infinity in silence
};

// One or two channels. A sound shorter than a window has neither figure.
ProgrammeLoudness programme_loudness(const Sound& sound);

}  // namespace clamor
