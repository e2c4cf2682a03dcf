// sound_memory.h: memory for decoded sound that the audio thread may read without a page fault.
//
// Address space is reserved for as much as there might ever be and costs nothing; what is wanted of
// it is brought in page by page, touched and, where the system allows it (RLIMIT_MEMLOCK), locked,
// so that reading it never waits for the kernel. What was let go reads as zeros, and would fault:
// who lets go must know that nobody reads it any more.
//
// Threads: bring() and decommit() of different ranges at once.
#pragma once

#include <cstddef>

namespace clamor {

class SoundMemory {
 public:
  // Of the system's; ranges that come and go by themselves begin and end on their edges.
  static std::size_t page_bytes();
  static std::size_t whole_pages(std::size_t bytes);

  // Throws std::bad_alloc where there is not even the address space.
  explicit SoundMemory(std::size_t bytes);
  ~SoundMemory();
  SoundMemory(const SoundMemory&) = delete;
  SoundMemory& operator=(const SoundMemory&) = delete;

  std::byte* data() const { return data_; }
  std::size_t bytes() const { return bytes_; }

  // Of whole pages, both. bring() says whether they are locked.
  bool bring(std::size_t first, std::size_t bytes);
  void decommit(std::size_t first, std::size_t bytes);

 private:
  std::byte* data_ = nullptr;
  const std::size_t bytes_;
};

}  // namespace clamor
