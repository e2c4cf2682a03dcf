#include "runtime/clamor_fork.h"

#include <atomic>

#include <pthread.h>

namespace clamor::interface {

namespace {

constinit std::atomic<std::uint32_t> forks{0};

void count_fork() { forks.fetch_add(1, std::memory_order_relaxed); }

}  // namespace

void watch_forks() {
  [[maybe_unused]] static const int registered = ::pthread_atfork(nullptr, nullptr, count_fork);
}

std::uint32_t fork_count() noexcept { return forks.load(std::memory_order_relaxed); }

}  // namespace clamor::interface
