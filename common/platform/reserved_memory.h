// reserved_memory.h: memory that the audio thread reads without page faults, such as decoded sound.
//
// Reserves address space for the largest possible size, which costs nothing. commit() faults pages
// in and, where the system allows it (RLIMIT_MEMLOCK), locks them. Decommitted memory reads as
// zeros but faults, so the caller must know that no thread still reads it.
//
// Threads: commit() and decommit() may run at once on different ranges.
#pragma once

#include <cstddef>

namespace clamor {

class ReservedMemory {
 public:
  // The system's page size, and `bytes` rounded up to it. Committed ranges must begin and end at
  // page boundaries.
  static std::size_t page_bytes();
  static std::size_t whole_pages(std::size_t bytes);

  // Throws std::bad_alloc if the address space is not available.
  explicit ReservedMemory(std::size_t bytes);
  ~ReservedMemory();
  ReservedMemory(const ReservedMemory&) = delete;
  ReservedMemory& operator=(const ReservedMemory&) = delete;

  std::byte* data() const { return data_; }
  std::size_t bytes() const { return bytes_; }

  // Both take whole pages. commit() returns whether they are locked.
  bool commit(std::size_t first, std::size_t bytes);
  void decommit(std::size_t first, std::size_t bytes);

 private:
  std::byte* data_ = nullptr;
  const std::size_t bytes_;
};

}  // namespace clamor
