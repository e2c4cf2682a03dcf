// audio_thread.h: what a device's thread does before its first block.
#pragma once

namespace clamor {

// Names the calling thread, and puts it before all that is not real time, below the kernel's own.
// Where that is not allowed, so be it. RtAudio would do the latter too, but prints a line about it;
// JACK does it for its own where its server does.
void begin_audio_thread(bool prioritise = true);

}  // namespace clamor
