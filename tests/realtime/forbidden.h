// forbidden.h: while one lives, this thread may not allocate, free, lock, wait or sleep: the
// program ends with a message if it does. forbidden.cpp interposes the functions.
#pragma once

namespace clamor::testing {

class Forbidden {
 public:
  Forbidden();
  ~Forbidden();
  Forbidden(const Forbidden&) = delete;
  Forbidden& operator=(const Forbidden&) = delete;
};

}  // namespace clamor::testing
