// play_status.h: what clamor play prints while it plays and at the end.
#pragma once

#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "common/listener.h"
#include "runtime/output/supervised_output.h"
#include "runtime/player/player.h"
#include "runtime/player/player_statistics.h"
#include "runtime/streaming/sound_statistics.h"
#include "tools/commands/play_history.h"

namespace clamor {

// Describes a device as "pulse: Headset at 44.1 kHz (resampled), 256 frames a block, 24 ms
// latency", or says that there is none yet.
std::string describe(const OutputStatistics& output);

// "sounds: 43.2 MB decoded, all of which fits into memory", or how much of it fits.
std::string sounds_line(const SoundStatistics& sounds);

// Time, voices, levels, place (as --listener takes it) and load, the most important first.
std::vector<std::string> status_fields(const PlayerStatistics& now, const Listener& listener,
                                       int channels);

// Reports problems while it plays, each once: a device that is lost and one that is back, and a
// file whose pages or sounds cannot be read.
class PlayNotices {
 public:
  explicit PlayNotices(std::ostream& err) : err_(err) {}

  void tell(const PlayerStatistics& now);

  // Reports failures of the file again, after it was replaced.
  void forget_file() { file_failed_ = false; }

 private:
  void tell_device(const OutputStatistics& output);

  std::ostream& err_;
  bool had_device_ = true, file_failed_ = false;
};

// Prints what was played, the device, CPU use, overload, and what was streamed.
void print_play_summary(const PlayerStatistics& played, const PlayHistory& history,
                        std::span<const ThreadCpuUsage> threads, std::ostream& err);

}  // namespace clamor
