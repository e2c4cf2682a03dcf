#include "runtime/hrtf/default_hrtf.h"

#include <cstddef>
#include <span>

#include "runtime/hrtf/hrtf.h"

// The assembler reads the file; as an array in C++ it would take seconds to compile.
#ifdef _WIN32
asm(R"(
  .section .rdata, "dr"
)"
#elif defined(__wasm__)  // whose symbols have sizes
asm(R"(
  .section .rodata.clamor_default_head,"",@
  .hidden clamor_default_head, clamor_default_head_end
  .size clamor_default_head, clamor_default_head_end - clamor_default_head
  .size clamor_default_head_end, 1
)"
#else
asm(R"(
  .section .rodata
  .hidden clamor_default_head, clamor_default_head_end
)"
#endif
    R"(
  .balign 16
  .globl clamor_default_head, clamor_default_head_end
clamor_default_head:
  .incbin ")" CLAMOR_DEFAULT_HEAD R"("
clamor_default_head_end:
  .text
)");

extern "C" {
extern const std::byte clamor_default_head[] __attribute__((visibility("hidden")));
extern const std::byte clamor_default_head_end[] __attribute__((visibility("hidden")));
}

namespace clamor {

std::shared_ptr<const Hrtf> default_hrtf() {
  return Hrtf::from_stored(std::span(clamor_default_head, clamor_default_head_end));
}

}  // namespace clamor
