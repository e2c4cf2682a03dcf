// reserved_memory.cpp: memory by mmap().
#include "common/platform/reserved_memory.h"

#include <cassert>
#include <new>

#include <sys/mman.h>
#include <unistd.h>

namespace clamor {

std::size_t ReservedMemory::page_bytes() {
  static const auto kPage = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return kPage;
}

std::size_t ReservedMemory::whole_pages(std::size_t bytes) {
  return (bytes + page_bytes() - 1) / page_bytes() * page_bytes();
}

ReservedMemory::ReservedMemory(std::size_t bytes) : bytes_(whole_pages(bytes)) {
  if (bytes_ == 0) return;
  int flags = MAP_PRIVATE | MAP_ANONYMOUS;
#ifdef MAP_NORESERVE
  flags |= MAP_NORESERVE;
#endif
  void* const data = ::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, flags, -1, 0);
  if (data == MAP_FAILED) throw std::bad_alloc();
  data_ = static_cast<std::byte*>(data);
#ifdef MADV_NOHUGEPAGE
  // Keep the kernel from merging small pages into huge ones while they are read, which would also
  // keep more memory than was committed.
  ::madvise(data_, bytes_, MADV_NOHUGEPAGE);
#endif
}

ReservedMemory::~ReservedMemory() {
  if (data_ != nullptr) ::munmap(data_, bytes_);
}

bool ReservedMemory::commit(std::size_t first, std::size_t bytes) {
  assert(first % page_bytes() == 0 && bytes % page_bytes() == 0 && first + bytes <= bytes_);
  // mlock() faults pages in; if it is not allowed, touching each page does.
  const bool locked = ::mlock(data_ + first, bytes) == 0;
  for (std::size_t at = first; at < first + bytes; at += page_bytes()) {
    volatile std::byte* const page = data_ + at;
    *page = std::byte{0};
  }
  return locked;
}

void ReservedMemory::decommit(std::size_t first, std::size_t bytes) {
  assert(first % page_bytes() == 0 && bytes % page_bytes() == 0 && first + bytes <= bytes_);
  // The kernel does not free locked pages. Unlocking pages that are not locked does no harm.
  ::munlock(data_ + first, bytes);
  ::madvise(data_ + first, bytes, MADV_DONTNEED);
}

}  // namespace clamor
