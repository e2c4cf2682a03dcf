// bus_error_guard.h: lets one thread look at mapped bytes of a file that may shrink or fail.
//
// The kernel raises SIGBUS on the thread that touches a page of a mapping which lies beyond the end
// of its file or which the disk cannot deliver. While a guard lives, such a fault of its thread
// within its range is answered by mapping zeros over the range from that page on. The code that
// reads goes on with zeros and fails its checksum; zeros() then tells what happened.
//
// The other way, siglongjmp() out of the handler, would leave behind whatever the interrupted code
// was about to free, and is undefined across objects with destructors: here that would be Cap'n
// Proto, zstd, libFLAC and our own vectors. With zeros nothing is skipped. mmap() is not on
// POSIX's list of functions that a handler may call, but on Linux it is one system call.
//
// Every other SIGBUS goes to the handler that was there before, with its arguments and flags, or to
// the system's default, as if this one did not exist: other threads, other addresses, and signals
// sent by another process. A handler that is installed later must pass on what it does not know.
//
// Threads: any. A guard belongs to the thread that made it; guards nest.   Cost: 0.2 us a guard.
#pragma once

#include <cstddef>
#include <span>

#include <signal.h>

namespace clamor {

// The pages of memory that hold any of the bytes.
std::span<std::byte> whole_pages(std::span<std::byte> bytes);

class BusErrorGuard {
 public:
  // Installs the handler of this process, the first time that it is called; false if it cannot.
  static bool install();

  // `bytes` are part of a mapping that nobody removes meanwhile.
  explicit BusErrorGuard(std::span<std::byte> bytes);
  ~BusErrorGuard();
  BusErrorGuard(const BusErrorGuard&) = delete;
  BusErrorGuard& operator=(const BusErrorGuard&) = delete;

  // The pages that were replaced by zeros, to be mapped again; empty if no access failed.
  std::span<std::byte> zeros() const;

 private:
  static void handle(int signal, siginfo_t* information, void* context);
  bool replace(void* address);

  const std::span<std::byte> pages_;
  std::byte* volatile zeros_begin_;  // the end of pages_ while there are none
  BusErrorGuard* const outer_;
  sigset_t blocked_before_{};
};

}  // namespace clamor
