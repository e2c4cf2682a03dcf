// Wraps malloc and its relatives to count allocations.
#include "tests/faults/allocations.h"

#include <atomic>

#include "tests/sanitized.h"

namespace {

std::atomic<std::size_t> largest{0}, all{0};

[[maybe_unused]] void count(std::size_t bytes) {
  all.fetch_add(bytes, std::memory_order_relaxed);
  if (bytes > largest.load(std::memory_order_relaxed)) largest = bytes;
}

}  // namespace

namespace clamor::testing {

void watch_allocations() { largest = all = 0; }
Allocations allocations() { return {largest, all}; }

}  // namespace clamor::testing

#ifndef CLAMOR_SANITIZED
extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);

void* malloc(std::size_t size) {
  count(size);
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) {
  count(number * size);
  return __libc_calloc(number, size);
}
void* realloc(void* block, std::size_t size) {
  count(size);
  return __libc_realloc(block, size);
}
}
#endif
