// stop_deadline.h: a command that is interrupted has ended within a second, whatever it is at.
//
// Commands look for Interrupt::requested() wherever they can. Some of their steps take long and
// cannot be asked to stop: Embree builds the tree of a large level, a system call waits for a disk
// that does not answer, a forged file has been found that keeps a loop busy. So a thread waits, and
// where the command has not ended in time, it ends the program as a kill would: outputs under way
// stay unfinished beside their names, as temporaries, and journals keep what was traced.
#pragma once

#include <string>
#include <thread>

namespace clamor {

class StopDeadline {
 public:
  // While it lives, beside an Interrupt. The sentence is what it ends the program with.
  explicit StopDeadline(const std::string& sentence);

 private:
  std::jthread thread_;
};

}  // namespace clamor
