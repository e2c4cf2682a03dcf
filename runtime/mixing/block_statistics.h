// block_statistics.h: what a mixer of blocks counts.
#pragma once

#include <array>
#include <cstdint>

#include "runtime/mixing/limiter.h"
#include "runtime/mixing/output_channels.h"

namespace clamor {

struct BlockStatistics {
  std::uint64_t held_blocks = 0;           // mixed without a keyframe that was due
  std::array<float, kMaxChannels> peak{};  // largest samples since the last reading
  std::uint64_t clipped_frames = 0;
  Limiter::Work limited{};
  std::uint64_t bad_voices = 0;   // muted for a keyframe: a gain or delay was not finite
  std::uint64_t late_voices = 0;  // muted for a keyframe: a piece of sound was missing
  std::uint32_t shed_voices = 0, max_shed_voices = 0;  // current, largest so far
  std::uint64_t shedding_blocks = 0;
};

}  // namespace clamor
