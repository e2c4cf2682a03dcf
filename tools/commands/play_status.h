// play_status.h: what clamor play says of its device and its threads.
#pragma once

#include <iosfwd>
#include <span>
#include <string>

#include "runtime/player/player.h"

namespace clamor {

// "pulse: Headset at 44.1 kHz (resampled), 256 frames a block, 24 ms latency", or that there is
// none yet.
std::string describe(const OutputStatistics& output);

// Says when the device is lost and when sound is back, each time once. `over_line`: of a terminal,
// where the status line stands.
class DeviceNotices {
 public:
  DeviceNotices(std::ostream& err, bool over_line) : err_(err), over_line_(over_line) {}
  void tell(const OutputStatistics& output);

 private:
  std::ostream& err_;
  const bool over_line_;
  bool had_device_ = true;
};

// "  NO DEVICE for 1.2 s" while there is none.
std::string device_note(const OutputStatistics& output);

// At the end.
void report(const OutputStatistics& output, std::ostream& err);
void report(std::span<const ThreadCpuUsage> threads, std::ostream& err);

}  // namespace clamor
