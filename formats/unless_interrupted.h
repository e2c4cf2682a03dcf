// unless_interrupted.h: what a system call returns once no signal interrupts it.
#pragma once

#include <cerrno>

namespace clamor {

template <class Call>
auto unless_interrupted(const Call& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

}  // namespace clamor
