// peak_memory.h: how much more memory this process held, at most, since a moment.
//
// As the kernel counts it, so whatever the allocator keeps for later counts too.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>

namespace clamor::testing {

class PeakMemory {
 public:
  // From now on.
  PeakMemory() {
    std::ofstream("/proc/self/clear_refs") << "5\n";  // forgets the peak
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
