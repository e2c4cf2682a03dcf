// stop_deadline.h: ends an interrupted command within a second, whatever it is doing.
//
// Commands poll Interrupt::requested() where they can. Some steps take long and cannot be stopped:
// Embree builds the BVH of a large level, a system call waits for a disk, a forged file keeps a
// loop busy. So a thread waits, and if the command has not ended in time, ends the program as a
// kill would: unfinished outputs stay as temporary files, and journals keep what was traced.
#pragma once

#include <string>
#include <thread>

namespace clamor {

class StopDeadline {
 public:
  // Active during its lifetime; needs an Interrupt. The sentence is printed when it ends the
  // program.
  explicit StopDeadline(const std::string& sentence);

 private:
  std::jthread thread_;
};

}  // namespace clamor
