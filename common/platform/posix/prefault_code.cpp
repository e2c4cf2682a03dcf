// prefault_code.cpp: the code of ELF programs and libraries.
#include "common/platform/prefault_code.h"

#include <cstddef>
#include <cstdint>

#include <link.h>
#include <unistd.h>

namespace clamor {

namespace {

// Reads one byte of each page without sanitizer checks: the bytes may lie between variables or be
// written by another thread.
[[gnu::no_sanitize_address, gnu::no_sanitize_thread, gnu::noinline]] void touch(
    std::uintptr_t first, std::size_t bytes) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const auto* const begin = reinterpret_cast<const volatile char*>(first);
  for (std::size_t at = 0; at < bytes; at += page) static_cast<void>(begin[at]);
}

void touch_segments(const dl_phdr_info& object) {
  for (int i = 0; i < object.dlpi_phnum; ++i) {
    const auto& segment = object.dlpi_phdr[i];
    if (segment.p_type == PT_LOAD && (segment.p_flags & PF_R) != 0)
      touch(object.dlpi_addr + segment.p_vaddr, segment.p_memsz);
  }
}

bool contains(const dl_phdr_info& object, std::uintptr_t address) {
  for (int i = 0; i < object.dlpi_phnum; ++i) {
    const auto& segment = object.dlpi_phdr[i];
    const std::uintptr_t first = object.dlpi_addr + segment.p_vaddr;
    if (segment.p_type == PT_LOAD && address >= first && address - first < segment.p_memsz)
      return true;
  }
  return false;
}

}  // namespace

void prefault_code() {
  const auto touch_object = [](dl_phdr_info* object, std::size_t, void*) {
    touch_segments(*object);
    return 0;
  };
  ::dl_iterate_phdr(touch_object, nullptr);
}

void prefault_library_code() {
  const auto touch_own_object = [](dl_phdr_info* object, std::size_t, void*) {
    if (!contains(*object, reinterpret_cast<std::uintptr_t>(&prefault_library_code))) return 0;
    touch_segments(*object);
    return 1;  // the search ends
  };
  ::dl_iterate_phdr(touch_own_object, nullptr);
}

}  // namespace clamor
