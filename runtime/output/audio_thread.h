// audio_thread.h: what a device's thread does before its first block.
#pragma once

namespace clamor {

// Names the calling thread and gives it real-time priority, below the kernel's own threads, where
// the system allows it. RtAudio could set the priority too but prints a line about it; JACK's
// server sets that of its own clients.
void begin_audio_thread(bool prioritise = true);

}  // namespace clamor
