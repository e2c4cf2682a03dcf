// thread.cpp: threads by POSIX and the GNU C library.
#include "common/platform/thread.h"

#include <algorithm>
#include <thread>

#include <pthread.h>
#include <sched.h>

namespace clamor {

void name_thread(const char* name) { ::pthread_setname_np(::pthread_self(), name); }

int usable_cores() {
  cpu_set_t cores;
  if (::sched_getaffinity(0, sizeof cores, &cores) == 0) return std::max(CPU_COUNT(&cores), 1);
  return std::max(static_cast<int>(std::thread::hardware_concurrency()), 1);
}

void prioritise_audio_thread() {
  constexpr sched_param kPriority{20};
  ::pthread_setschedparam(::pthread_self(), SCHED_RR, &kPriority);
}

std::optional<clockid_t> clock_of_this_thread() noexcept {
  clockid_t clock{};
  if (::pthread_getcpuclockid(::pthread_self(), &clock) != 0) return std::nullopt;
  return clock;
}

CancellationDelay::CancellationDelay() noexcept {
  ::pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, &before_);
}

CancellationDelay::~CancellationDelay() {
  int ours = 0;
  ::pthread_setcancelstate(before_, &ours);
}

}  // namespace clamor
