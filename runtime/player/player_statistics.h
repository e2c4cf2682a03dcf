// player_statistics.h: what a player counts while it runs.
#pragma once

#include <cstdint>

#include "runtime/engine/auralizer_statistics.h"
#include "runtime/output/supervised_output.h"

namespace clamor {

struct PlayerStatistics {
  AuralizerStatistics auralizer;
  OutputStatistics output;
  double time_s = 0;                               // played so far
  double momentary_lufs = 0, short_term_lufs = 0;  // -infinity in silence
  std::uint64_t dropped_samples = 0;               // that the recording could not take in time
};

}  // namespace clamor
