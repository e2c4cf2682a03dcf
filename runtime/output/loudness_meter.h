// loudness_meter.h: momentary and short-term loudness of the output by BS.1770, for a status line.
//
// Momentary is over 400 ms, short-term over 3 s (EBU Tech 3341). Side loudspeakers count 1.5 dB
// more, the LFE channel is ignored. Ambisonics are measured by their omnidirectional component in
// two channels, which is as loud as two omnidirectional receivers in the same place.
//
// Threads: all members on one thread, which must not be the audio thread: libebur128 allocates.
#pragma once

#include <memory>
#include <span>

#include "formats/audio/wav_writer.h"

namespace clamor {

class LoudnessMeter {
 public:
  // `speakers` is empty for stereo and for Ambisonics.
  LoudnessMeter(int channels, std::span<const Speaker> speakers);
  ~LoudnessMeter();

  void add(std::span<const float> interleaved);  // whole frames

  // Loudness now; -infinity in silence.
  double momentary_lufs() const;
  double short_term_lufs() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clamor
