// forbidden.h: while one lives, this thread may not allocate, free, lock, wait or sleep, nor call
// the system at all: the program ends with a message if it does. forbidden.cpp interposes the
// functions, and has the kernel refuse this thread's system calls (since Linux 5.11).
#pragma once

namespace clamor::testing {

class Forbidden {
 public:
  Forbidden();
  ~Forbidden();
  Forbidden(const Forbidden&) = delete;
  Forbidden& operator=(const Forbidden&) = delete;

  static bool watches_system_calls();  // can this kernel do so
};

// Page faults of this thread so far, with disk and without.
long page_faults();

}  // namespace clamor::testing
