// thread.cpp: threads by POSIX and the GNU C library.
#include "common/platform/thread.h"

#include <pthread.h>
#include <sched.h>

namespace clamor {

void name_thread(const char* name) { ::pthread_setname_np(::pthread_self(), name); }

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
