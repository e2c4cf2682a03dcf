// fault_injection.h: disks that fill up, fail, or stop half-way, at a moment that the test chooses.
//
// fault_injection.cpp stands before the C library's open, read, write and so on. While a
// FaultInjection lives, calls on files in its folder are counted, and one of them fares as the plan
// says. Others are left alone.
#pragma once

#include <cerrno>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace clamor::testing {

enum class FaultKind {
  kFails,                  // this call alone, with the plan's errno
  kPersistentFailure,      // this and every later one: a disk that is full stays full
  kPartialTransfer,        // a read or write does half of what it is asked for
  kRunCallback,            // as if nothing were, but `meanwhile` is done first
  kRunCallbackFromThenOn,  // the same for this and every later one, on whichever thread
};

struct FaultPlan {
  std::string folder{};
  std::string calls{};     // which may be struck, separated by spaces; "" for all that are counted
  std::string thread{};    // whose; "" for all
  long fail_at_call = -1;  // so many of them go well before; -1: nothing is struck
  FaultKind fate = FaultKind::kFails;
  int error = ENOSPC;
  std::function<void()> meanwhile{};
};

// One at a time.
class FaultInjection {
 public:
  explicit FaultInjection(FaultPlan plan);
  ~FaultInjection();
  FaultInjection(const FaultInjection&) = delete;
  FaultInjection& operator=(const FaultInjection&) = delete;

  bool struck() const;                   // was there a call to strike
  std::vector<std::string> log() const;  // "fsync hall.clamor.HOST.1234.tmp", in order
};

// The number of calls in a log that begin so.
long count_of(const std::vector<std::string>& log, std::string_view beginning);

}  // namespace clamor::testing
