// peak_memory.h: the peak growth of this process's memory since a moment.
//
// The kernel counts, so memory that the allocator keeps for later counts as well.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>

namespace clamor::testing {

class PeakMemory {
 public:
  // Starts measuring.
  PeakMemory() {
    std::ofstream("/proc/self/clear_refs") << "5\n";  // resets the peak
    before_bytes_ = status_bytes("VmRSS:");
    known_ = before_bytes_ > 0 && status_bytes("VmHWM:") < before_bytes_ + 10'000'000;
  }

  bool known() const { return known_; }
  std::uint64_t more_bytes() const { return status_bytes("VmHWM:") - before_bytes_; }

 private:
  static std::uint64_t status_bytes(const std::string& name) {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
      if (std::uint64_t kilobytes = 0; word == name && status >> kilobytes) return kilobytes * 1024;
    return 0;
  }

  std::uint64_t before_bytes_ = 0;
  bool known_ = false;
};

}  // namespace clamor::testing
