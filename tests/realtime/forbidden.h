// forbidden.h: while an object of this class lives, its thread may not allocate, free, lock, wait,
// sleep or make any system call; otherwise the program ends with a message. forbidden.cpp
// interposes the functions and lets the kernel reject this thread's system calls (since Linux
// 5.11).
#pragma once

namespace clamor::testing {

class Forbidden {
 public:
  Forbidden();
  ~Forbidden();
  Forbidden(const Forbidden&) = delete;
  Forbidden& operator=(const Forbidden&) = delete;

  static bool watches_system_calls();  // whether this kernel can
};

// Page faults of this thread so far, with and without disk access.
long page_faults();

}  // namespace clamor::testing
