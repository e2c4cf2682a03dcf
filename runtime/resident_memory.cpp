#include "runtime/resident_memory.h"

#include <cstddef>

#include <link.h>
#include <unistd.h>

namespace clamor {

void touch_all_code() {
  const auto touch = [](dl_phdr_info* object, std::size_t, void*) {
    const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    for (int i = 0; i < object->dlpi_phnum; ++i) {
      const auto& segment = object->dlpi_phdr[i];
      if (segment.p_type != PT_LOAD || (segment.p_flags & PF_R) == 0) continue;
      const auto* const bytes = reinterpret_cast<const volatile char*>(object->dlpi_addr) +
                                static_cast<std::ptrdiff_t>(segment.p_vaddr);
      for (std::size_t at = 0; at < segment.p_memsz; at += page) static_cast<void>(bytes[at]);
    }
    return 0;
  };
  ::dl_iterate_phdr(touch, nullptr);
}

}  // namespace clamor
