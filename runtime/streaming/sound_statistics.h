// sound_statistics.h: what a sound loader counts.
#pragma once

#include <cstdint>
#include <string>

namespace clamor {

struct SoundStatistics {
  std::uint64_t loaded = 0, dropped = 0, failed = 0;  // pieces
  std::uint64_t resident = 0, bytes = 0;              // pieces, and their memory
  std::uint64_t max_bytes = 0;                        // high-water mark
  std::uint64_t all_bytes = 0, budget_bytes = 0;      // of all sounds decoded, and the most allowed
  std::uint64_t locked_bytes = 0;
  bool lock_refused = false;      // the system has refused to lock some memory
  std::uint64_t over_budget = 0;  // pieces needed now that did not fit into the budget
  std::uint64_t late = 0;         // voices muted for a keyframe because a piece was not resident
  // Keyframes in which sources whose sound was not resident left their voices to others.
  std::uint64_t handed_over = 0;
  std::string failure;  // the first one, as a sentence
};

}  // namespace clamor
