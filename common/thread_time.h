// thread_time.h: processor time of the calling thread.
#pragma once

#include <ctime>

namespace clamor {

// Costs a system call, so the audio thread must not call it.
inline double thread_time_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace clamor
