// play_summary.h: the closing lines of clamor play.
#pragma once

#include <iosfwd>
#include <span>

#include "runtime/player/player.h"
#include "runtime/player/player_statistics.h"
#include "tools/commands/play_history.h"

namespace clamor {

// Prints what was played, the device, CPU use, overload, and what was streamed.
void print_play_summary(const PlayerStatistics& played, const PlayHistory& history,
                        std::span<const ThreadCpuUsage> threads, std::ostream& err);

}  // namespace clamor
