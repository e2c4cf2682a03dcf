// allocations.h: how much memory is asked for. allocations.cpp stands before malloc; not under
// sanitizers, which do so themselves, and where this counts nothing.
#pragma once

#include <cstddef>

namespace clamor::testing {

// From now on.
void watch_allocations();

struct Allocations {
  std::size_t largest = 0, all = 0;  // bytes
};
Allocations allocations();

}  // namespace clamor::testing
