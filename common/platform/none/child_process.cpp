// child_process.cpp: no child processes, since neither Windows nor WebAssembly can fork.
#include "common/platform/child_process.h"

namespace clamor {

Result<std::vector<std::byte>> in_child_process(const ChildLimits&,
                                                const std::function<std::vector<std::byte>()>&) {
  return Error(
      "cannot be read on this system, where a crash of the library that reads it would end "
      "the program");
}

}  // namespace clamor
