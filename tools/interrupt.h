// interrupt.h: Ctrl-C asks long work to end; a second one ends the program at once.
#pragma once

#include <atomic>

namespace clamor {

// While it lives, SIGINT and SIGTERM set requested().
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  static const std::atomic<bool>& requested();
};

}  // namespace clamor
