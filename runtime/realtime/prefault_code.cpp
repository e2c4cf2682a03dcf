#include "runtime/realtime/prefault_code.h"

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

}  // namespace

void prefault_code() {
  const auto touch_segments = [](dl_phdr_info* object, std::size_t, void*) {
    for (int i = 0; i < object->dlpi_phnum; ++i) {
      const auto& segment = object->dlpi_phdr[i];
      if (segment.p_type == PT_LOAD && (segment.p_flags & PF_R) != 0)
        touch(object->dlpi_addr + segment.p_vaddr, segment.p_memsz);
    }
    return 0;
  };
  ::dl_iterate_phdr(touch_segments, nullptr);
}

}  // namespace clamor
