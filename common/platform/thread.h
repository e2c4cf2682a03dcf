// thread.h: what the system knows of a thread.
#pragma once

#include <ctime>
#include <optional>

namespace clamor {

// Names the calling thread for debuggers and for ThreadCpuMeter. Linux keeps 15 characters.
void name_thread(const char* name);

// Processors that the process may use at once, at least 1.
int usable_cores();

// Gives the calling thread real-time priority, below the kernel's own threads, where the system
// allows it.
void prioritise_audio_thread();

// The clock of the CPU time of the calling thread, for cpu_time_s() on any thread (cpu_time.h).
// Computed from the thread's id, without a system call.
std::optional<clockid_t> clock_of_this_thread() noexcept;

// During its lifetime, other threads' requests to cancel the calling thread wait.
class CancellationDelay {
 public:
  CancellationDelay() noexcept;
  ~CancellationDelay();
  CancellationDelay(const CancellationDelay&) = delete;
  CancellationDelay& operator=(const CancellationDelay&) = delete;

 private:
  [[maybe_unused]] int before_ = 0;  // of POSIX
};

}  // namespace clamor
