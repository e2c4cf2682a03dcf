// reserved_memory.cpp: memory by VirtualAlloc(). Other than elsewhere, a read of memory that is not
// committed ends the program.
#include "common/platform/reserved_memory.h"

#include <cassert>
#include <new>

#include "common/platform/windows/win32.h"

namespace clamor {

std::size_t ReservedMemory::page_bytes() {
  static const std::size_t kPage = [] {
    SYSTEM_INFO system{};
    ::GetSystemInfo(&system);
    return std::size_t{system.dwPageSize};
  }();
  return kPage;
}

std::size_t ReservedMemory::whole_pages(std::size_t bytes) {
  return (bytes + page_bytes() - 1) / page_bytes() * page_bytes();
}

ReservedMemory::ReservedMemory(std::size_t bytes) : bytes_(whole_pages(bytes)) {
  if (bytes_ == 0) return;
  data_ = static_cast<std::byte*>(::VirtualAlloc(nullptr, bytes_, MEM_RESERVE, PAGE_READWRITE));
  if (data_ == nullptr) throw std::bad_alloc();
}

ReservedMemory::~ReservedMemory() {
  if (data_ != nullptr) ::VirtualFree(data_, 0, MEM_RELEASE);
}

bool ReservedMemory::commit(std::size_t first, std::size_t bytes) {
  assert(first % page_bytes() == 0 && bytes % page_bytes() == 0 && first + bytes <= bytes_);
  if (bytes == 0) return true;
  if (::VirtualAlloc(data_ + first, bytes, MEM_COMMIT, PAGE_READWRITE) == nullptr)
    throw std::bad_alloc();
  // Windows locks little unless the application raises the least working set of its process.
  const bool locked = ::VirtualLock(data_ + first, bytes) != 0;
  for (std::size_t at = first; at < first + bytes; at += page_bytes()) {
    volatile std::byte* const page = data_ + at;
    *page = std::byte{0};
  }
  return locked;
}

void ReservedMemory::decommit(std::size_t first, std::size_t bytes) {
  assert(first % page_bytes() == 0 && bytes % page_bytes() == 0 && first + bytes <= bytes_);
  if (bytes > 0) ::VirtualFree(data_ + first, bytes, MEM_DECOMMIT);
}

}  // namespace clamor
