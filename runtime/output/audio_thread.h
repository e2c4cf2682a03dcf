// audio_thread.h: what a device's thread does before its first block.
#pragma once

#include <pthread.h>
#include <sched.h>

#include "runtime/realtime/thread_cpu_usage.h"

namespace clamor {

// Names the calling thread and gives it real-time priority, below the kernel's own threads, where
// the system allows it. RtAudio could set the priority too but prints a line about it; JACK's
// server sets that of its own clients.
inline void begin_audio_thread(bool prioritise = true) {
  constexpr sched_param kPriority{20};
  name_thread("audio");
  if (prioritise) ::pthread_setschedparam(::pthread_self(), SCHED_RR, &kPriority);
}

}  // namespace clamor
