// child_process.cpp: no child processes, since Windows cannot fork.
#include "common/platform/child_process.h"

namespace clamor {

Result<std::vector<std::byte>> in_child_process(const ChildLimits&,
                                                const std::function<std::vector<std::byte>()>&) {
  return Error(
      "cannot be read on Windows, where a crash of the library that reads it would end "
      "the program");
}

}  // namespace clamor
