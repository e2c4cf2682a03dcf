// bus_error_guard.h: lets a thread read a memory-mapped file that may shrink or fail.
//
// The kernel raises SIGBUS on the thread that touches a mapped page beyond the end of its file, or
// a page that the disk cannot deliver. While a guard lives, such a fault of its thread within its
// range is handled by mapping zeros over the range from that page on. The reading code continues
// with zeros and fails its checksum; zeros() then reports the fault.
//
// The alternative, siglongjmp() out of the handler, would leak whatever the interrupted code was
// about to free and is undefined across objects with destructors: Cap'n Proto, zstd, libFLAC and
// std::vector here. mmap() is not on POSIX's list of async-signal-safe functions, but on Linux it
// is a single system call.
//
// Every other SIGBUS (other threads, other addresses, signals sent by a process) is passed to the
// previous handler with its arguments and flags, or to the default action. Handlers that are
// installed later must pass on signals that they do not handle.
//
// Threads: any. A guard belongs to the thread that created it; guards nest.   Cost: 0.2 us a guard.
#pragma once

#include <cstddef>
#include <span>

namespace clamor {

// The memory pages that contain any of the bytes.
std::span<std::byte> whole_pages(std::span<std::byte> bytes);

class BusErrorGuard {
 public:
  // Installs the signal handler at the first call. Returns false on failure.
  static bool install();

  // `bytes` must belong to a mapping that outlives the guard.
  explicit BusErrorGuard(std::span<std::byte> bytes);
  ~BusErrorGuard();
  BusErrorGuard(const BusErrorGuard&) = delete;
  BusErrorGuard& operator=(const BusErrorGuard&) = delete;

  // Replaces the page and what follows it by zeros, if a guard of this thread covers the address.
  // For the signal handler.
  static bool replace_for_thread(void* address);

  // Pages replaced by zeros, which the caller maps again; empty if no access failed.
  std::span<std::byte> zeros() const;

 private:
  bool replace(void* address);

  const std::span<std::byte> pages_;
  std::byte* volatile zeros_begin_;  // end of pages_ while there are no zeros
  BusErrorGuard* const outer_;
  bool was_blocked_ = false;
};

}  // namespace clamor
