// fault_injection.h: makes disks fill up, fail or block at a moment that the test chooses.
//
// fault_injection.cpp replaces the C library's open, read, write and so on. During the lifetime of
// a FaultInjection, calls on files in its folder are counted, and one of them fails as planned.
// Other calls are unaffected.
#pragma once

#include <cerrno>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace clamor::testing {

enum class FaultKind {
  kFails,                  // fails this call with the plan's errno
  kPersistentFailure,      // fails this and every later call, as a full disk does
  kPartialTransfer,        // reads or writes only half of the bytes
  kRunCallback,            // calls `meanwhile` first, then proceeds
  kRunCallbackFromThenOn,  // the same for this and every later call, on any thread
};

struct FaultPlan {
  std::string folder{};
  std::string calls{};     // functions that may fail, separated by spaces; "" for all
  std::string thread{};    // name of the thread; "" for all
  long fail_at_call = -1;  // index of the call that fails; -1: none
  FaultKind fate = FaultKind::kFails;
  int error = ENOSPC;
  std::function<void()> meanwhile{};
};

// At most one at a time.
class FaultInjection {
 public:
  explicit FaultInjection(FaultPlan plan);
  ~FaultInjection();
  FaultInjection(const FaultInjection&) = delete;
  FaultInjection& operator=(const FaultInjection&) = delete;

  bool struck() const;                   // whether a call was made to fail
  std::vector<std::string> log() const;  // in order, as "fsync hall.clamor.HOST.1234.tmp"
};

// Number of log entries that begin with that text.
long count_of(const std::vector<std::string>& log, std::string_view beginning);

}  // namespace clamor::testing
