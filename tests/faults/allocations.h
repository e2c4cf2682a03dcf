// allocations.h: counts allocations. allocations.cpp replaces malloc, except under sanitizers,
// which replace it themselves; there nothing is counted.
#pragma once

#include <cstddef>

namespace clamor::testing {

// Restarts counting.
void watch_allocations();

struct Allocations {
  std::size_t largest = 0, all = 0;  // bytes
};
Allocations allocations();

}  // namespace clamor::testing
