// interrupt.h: ends commands in order on Ctrl-C, a closed terminal or a closed output pipe.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "common/platform/signals.h"

namespace clamor {

// Milliseconds of a clock that never goes back. A signal handler may call it.
std::int64_t monotonic_ms();

// During its lifetime, SIGINT, SIGTERM, SIGHUP, and SIGPIPE of standard output or error set
// requested(). A SIGINT or SIGTERM more than half a second later ends the program at once.
class Interrupt {
 public:
  // Like monotonic_ms(). A test has a clock of its own.
  using Clock = std::int64_t (*)();

  explicit Interrupt(Clock clock = monotonic_ms);
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  static const std::atomic<bool>& requested();
  // Forgets requests to earlier commands of this process.
  static void forget();

 private:
  SignalHandlers signals_;
};

// During its lifetime, SIGINT, SIGTERM and SIGHUP end the program at once, with exit code 130 and a
// message on standard error. For commands that have created nothing that must be removed.
class ExitOnSignal {
 public:
  explicit ExitOnSignal(const std::string& command);
  ExitOnSignal(const ExitOnSignal&) = delete;
  ExitOnSignal& operator=(const ExitOnSignal&) = delete;

 private:
  SignalHandlers signals_;
};

// Ends an interrupted command within a second, whatever it is doing.
//
// Commands poll Interrupt::requested() where they can. Some steps take long and cannot be stopped:
// Embree builds the BVH of a large level, a system call waits for a disk, a forged file keeps a
// loop busy. So a thread waits, and if the command has not ended in time, ends the program as a
// kill would: unfinished outputs stay as temporary files, and journals keep what was traced.
class StopDeadline {
 public:
  // Active during its lifetime; needs an Interrupt. The sentence is printed when it ends the
  // program.
  explicit StopDeadline(const std::string& sentence);

 private:
  std::jthread thread_;
};

}  // namespace clamor
