// loudness_meter.h: how loud what is played is now, by BS.1770, for a status line.
//
// Momentary over 400 ms, short-term over 3 s (EBU Tech 3341). Loudspeakers at the sides count 1.5
// dB more, LFE nothing. Ambisonics count as their omnidirectional component in two channels, which
// is as loud as two omnidirectional receivers in the same place.
//
// Threads: add() and the figures on one, and not the audio thread: libebur128 allocates.
#pragma once

#include <memory>
#include <span>

#include "formats/audio/wav_writer.h"

namespace clamor {

class LoudnessMeter {
 public:
  // `speakers` is empty for stereo, and for components that are no loudspeakers.
  LoudnessMeter(int channels, std::span<const Speaker> speakers);
  ~LoudnessMeter();

  void add(std::span<const float> interleaved);  // whole frames

  // -infinity in silence.
  double momentary_lufs() const;
  double short_term_lufs() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clamor
