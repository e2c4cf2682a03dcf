// cpu_time.h: processor time of a thread and of the process.
//
// Each costs a system call, so the audio thread must not call them.
#pragma once

#include <ctime>

namespace clamor {

inline double cpu_time_s(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// The CPU time of the calling thread.
inline double thread_time_s() { return cpu_time_s(CLOCK_THREAD_CPUTIME_ID); }

// The CPU time of all threads, also of those that have ended.
inline double process_time_s() { return cpu_time_s(CLOCK_PROCESS_CPUTIME_ID); }

}  // namespace clamor
