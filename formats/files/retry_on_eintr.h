// retry_on_eintr.h: repeats a system call while signals interrupt it.
#pragma once

#include <cerrno>

namespace clamor {

template <class Call>
auto retry_on_eintr(const Call& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

}  // namespace clamor
