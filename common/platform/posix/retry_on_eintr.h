// retry_on_eintr.h: repeats a system call while signals interrupt it, or until all is transferred.
#pragma once

#include <cerrno>
#include <cstddef>

namespace clamor {

template <class Call>
auto retry_on_eintr(const Call& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

// Calls some(done, left), which returns how many bytes it transferred, until all `count` are. False
// with its errno once it transfers none; a write of 0 bytes means that the disk is full.
template <class Some>
bool transfer_all(std::size_t count, const Some& some) {
  for (std::size_t done = 0; done < count;) {
    errno = ENOSPC;
    const auto now = retry_on_eintr([&] { return some(done, count - done); });
    if (now <= 0) return false;
    done += static_cast<std::size_t>(now);
  }
  return true;
}

}  // namespace clamor
