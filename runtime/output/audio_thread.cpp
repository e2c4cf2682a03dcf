#include "runtime/output/audio_thread.h"

#include <pthread.h>
#include <sched.h>

#include "runtime/realtime/thread_cpu_usage.h"

namespace clamor {

namespace {

constexpr int kPriority = 20;

}  // namespace

void begin_audio_thread(bool prioritise) {
  name_thread("audio");
  if (!prioritise) return;
  const sched_param priority{kPriority};
  ::pthread_setschedparam(::pthread_self(), SCHED_RR, &priority);
}

}  // namespace clamor
