// sound_analysis.h: all measurements of one sound, for comparison with others.
//
// A sound is a programme (a scene, a texture, music) or an impulse response. Both have a spectrum
// in ERB bands and, in stereo, binaural cues. A programme has loudness, clicks and texture; a
// response has room parameters, decay curves and echo densities, per octave and ear.
#pragma once

#include <array>
#include <vector>

#include "common/bands.h"
#include "formats/audio/audio_file.h"
#include "runtime/hrtf/erb_bands.h"
#include "tools/analysis/binaural_cues.h"
#include "tools/analysis/click_detector.h"
#include "tools/analysis/programme_loudness.h"
#include "tools/analysis/room_parameters.h"
#include "tools/analysis/texture_statistics.h"

namespace clamor {

enum class SoundKind { kProgramme, kImpulseResponse };

struct SoundAnalysis {
  SoundKind kind = SoundKind::kProgramme;
  Sound sound = {};
  ProgrammeLoudness loudness = {};
  ErbBands spectrum{};
  BinauralCues binaural = {};
  BinauralCues early_binaural = {};  // of a response: 80 ms from the direct sound on

  struct Ear {
    std::vector<Click> clicks;
    TextureStatistics texture;
    RoomParameters room;
    // From the direct sound on, every kEchoDensityHop_s: decay curve in dB, and echo density.
    std::array<std::vector<double>, kBandCount> decay_db, echo_density;
  };
  std::vector<Ear> ears = {};
};

// Returns whether a sound begins abruptly and decays to silence: the energy centroid after the
// direct sound lies in the first eighth of the rest, and the last tenth has less than a thousandth
// of the energy.
bool looks_like_impulse_response(const Sound& sound);

// One or two channels of finite samples, at least one sample. Takes 16 ms per second and channel of
// a programme, 150 ms of an impulse response.
SoundAnalysis analyse(Sound sound, SoundKind kind);

}  // namespace clamor
