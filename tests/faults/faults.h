// faults.h: disks that fill up, fail, or stop half-way, at a moment that the test chooses.
//
// faults.cpp stands before the C library's open, read, write and so on. While a Faults lives, calls
// on files in its folder are counted, and one of them fares as the plan says. Others are left
// alone.
#pragma once

#include <cerrno>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace clamor::testing {

enum class Fate {
  kFails,        // this call alone, with the plan's errno
  kStaysSo,      // this and every later one: a disk that is full stays full
  kFallsShort,   // a read or write does half of what it is asked for
  kGoesOn,       // as if nothing were, but `meanwhile` is done first
  kStandsStill,  // the same for this and every later one, on whichever thread
};

struct FaultPlan {
  std::string folder{};
  std::string calls{};   // which may be struck, separated by spaces; "" for all that are counted
  std::string thread{};  // whose; "" for all
  long strike_at = -1;   // so many of them go well before; -1: nothing is struck
  Fate fate = Fate::kFails;
  int error = ENOSPC;
  std::function<void()> meanwhile{};
};

// One at a time.
class Faults {
 public:
  explicit Faults(FaultPlan plan);
  ~Faults();
  Faults(const Faults&) = delete;
  Faults& operator=(const Faults&) = delete;

  bool struck() const;                   // was there a call to strike
  std::vector<std::string> log() const;  // "fsync hall.clamor.HOST.1234.tmp", in order
};

// The number of calls in a log that begin so.
long count_of(const std::vector<std::string>& log, std::string_view beginning);

}  // namespace clamor::testing
