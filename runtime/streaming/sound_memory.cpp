#include "runtime/streaming/sound_memory.h"

#include <cassert>
#include <new>

#include <sys/mman.h>
#include <unistd.h>

namespace clamor {

std::size_t SoundMemory::page_bytes() {
  static const auto kPage = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return kPage;
}

std::size_t SoundMemory::whole_pages(std::size_t bytes) {
  return (bytes + page_bytes() - 1) / page_bytes() * page_bytes();
}

SoundMemory::SoundMemory(std::size_t bytes) : bytes_(whole_pages(bytes)) {
  if (bytes_ == 0) return;
  int flags = MAP_PRIVATE | MAP_ANONYMOUS;
#ifdef MAP_NORESERVE
  flags |= MAP_NORESERVE;
#endif
  void* const data = ::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, flags, -1, 0);
  if (data == MAP_FAILED) throw std::bad_alloc();
  data_ = static_cast<std::byte*>(data);
#ifdef MADV_NOHUGEPAGE
  // Nobody shall make huge pages of small ones while they are read, nor keep more than was asked
  // for.
  ::madvise(data_, bytes_, MADV_NOHUGEPAGE);
#endif
}

SoundMemory::~SoundMemory() {
  if (data_ != nullptr) ::munmap(data_, bytes_);
}

bool SoundMemory::bring(std::size_t first, std::size_t bytes) {
  assert(first % page_bytes() == 0 && bytes % page_bytes() == 0 && first + bytes <= bytes_);
  // Locking brings pages in by itself; touching is for where it may not.
  const bool locked = ::mlock(data_ + first, bytes) == 0;
  for (std::size_t at = first; at < first + bytes; at += page_bytes()) {
    volatile std::byte* const page = data_ + at;
    *page = std::byte{0};
  }
  return locked;
}

void SoundMemory::decommit(std::size_t first, std::size_t bytes) {
  assert(first % page_bytes() == 0 && bytes % page_bytes() == 0 && first + bytes <= bytes_);
  // The kernel would not take back what is locked. Unlocking what is not does no harm.
  ::munlock(data_ + first, bytes);
  ::madvise(data_ + first, bytes, MADV_DONTNEED);
}

}  // namespace clamor
