#include "runtime/clamor_fork.h"

#include <atomic>

#include "common/platform/process.h"

namespace clamor::interface {

namespace {

constinit std::atomic<std::uint32_t> forks{0};

void count_fork() { forks.fetch_add(1, std::memory_order_relaxed); }

}  // namespace

void watch_forks() {
  [[maybe_unused]] static const bool registered = (call_in_forks(count_fork), true);
}

std::uint32_t fork_count() noexcept { return forks.load(std::memory_order_relaxed); }

}  // namespace clamor::interface
