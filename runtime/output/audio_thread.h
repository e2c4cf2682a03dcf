// audio_thread.h: what a device's thread does before its first block.
#pragma once

#include "common/platform/thread.h"

namespace clamor {

// Names the calling thread and gives it real-time priority. RtAudio could set the priority too but
// prints a line about it; JACK's server sets that of its own clients.
inline void begin_audio_thread(bool prioritise = true) {
  name_thread("audio");
  if (prioritise) prioritise_audio_thread();
}

}  // namespace clamor
