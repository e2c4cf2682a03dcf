// child_process.h: runs what may crash, hang or ask for any memory, apart from this process.
//
// For libraries that read files of which nothing is known. The work is done in a copy of this
// process (fork) that has limits and a memory of its own; what it finds comes back through a pipe
// as plain bytes, which the caller checks like those of a file. It keeps damage away from this
// process's memory; it is no prison for code that means harm.
//
// Threads: any, also several at once. The work may allocate and read files, as glibc lets it after
// a fork; it must not wait for other threads, which are not there. Cost: about a millisecond.
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
  std::uint64_t memory_bytes = 1'000'000'000;  // beyond what this process has
  unsigned cpu_s = 10;
  unsigned wall_s = 60;  // for work that waits, as for a file system that does not answer
  std::uint64_t max_result_bytes = 4'000'000'000;
};

// Returns what `work` returns; the Error says what became of it ("crashes", "takes more than 10 s
// to read").
Result<std::vector<std::byte>> in_child_process(
    const ChildLimits& limits, const std::function<std::vector<std::byte>()>& work);

}  // namespace clamor
