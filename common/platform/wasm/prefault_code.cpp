// prefault_code.cpp: nothing, since WebAssembly's code is no part of its memory.
#include "common/platform/prefault_code.h"

namespace clamor {

void prefault_code() {}

void prefault_library_code() {}

}  // namespace clamor
