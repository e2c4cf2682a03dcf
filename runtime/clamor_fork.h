// clamor_fork.h: notices that a process is the child of a fork, in which no thread of the library
// runs. Not installed.
//
// Threads: any.   Cost: of fork_count(), a load.
#pragma once

#include <cstdint>

namespace clamor::interface {

// Counts forks from the first call on.
void watch_forks();

// How many forks led from the process that watches to this one. 0 in that process itself.
std::uint32_t fork_count() noexcept;

}  // namespace clamor::interface
