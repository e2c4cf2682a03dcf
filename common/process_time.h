// process_time.h: processor time of this process.
#pragma once

#include <ctime>

namespace clamor {

// Of all threads, also of those that have ended. Costs a system call, so the audio thread must not
// call it.
inline double process_time_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace clamor
