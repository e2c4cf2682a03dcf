// child_process.h: runs a function that may crash, hang or exhaust memory in a child process.
//
// For libraries that parse untrusted files. The work runs in a fork of this process with resource
// limits; its result comes back through a pipe as bytes, which the caller validates like a file. A
// crash cannot damage this process, but this is no sandbox against malicious code.
//
// Threads: any, concurrently. The work may allocate and read files, which glibc allows after
// fork(); it must not wait for other threads, which the child does not have. Cost: about 1 ms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"

namespace clamor {

struct ChildLimits {
  std::uint64_t memory_bytes = 1'000'000'000;  // in addition to what this process has mapped
  unsigned cpu_s = 10;
  unsigned wall_s = 60;  // wall clock, for work that blocks on a file system
  std::uint64_t max_result_bytes = 4'000'000'000;
};

// Returns the result of `work`, or an Error that says how it failed ("crashes", "takes more than 10
// s to read").
Result<std::vector<std::byte>> in_child_process(
    const ChildLimits& limits, const std::function<std::vector<std::byte>()>& work);

}  // namespace clamor
