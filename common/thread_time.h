// thread_time.h: how long the calling thread has worked, whatever others did meanwhile.
#pragma once

#include <ctime>

namespace clamor {

// Seconds of processor time. Costs a system call, so not for the audio thread.
inline double thread_time_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace clamor
