// memory_budget.h: how the memory of an auralizer is shared among pages and sounds.
#pragma once

#include <algorithm>
#include <cstdint>

namespace clamor {

// By default sounds may use what all of them take decoded, but no more than this, and pages this.
inline constexpr std::uint64_t kDefaultMaxSounds_bytes = 256'000'000;
inline constexpr std::uint64_t kDefaultPages_bytes = 64'000'000;

// Sounds may always use this, since pages without sounds are silent: above the longest whole
// signal.
inline constexpr std::uint64_t kMinSounds_bytes = 8'000'000;

struct MemoryBudget {
  std::uint64_t sounds = 0, pages = 0;
  std::uint64_t probe_pages = 0;  // on top

  // `bytes` is for pages and sounds, which may use up to half of it; 0: the default.
  // `all_sounds_bytes` is what all sounds take decoded.
  static MemoryBudget of(std::uint64_t bytes, std::uint64_t all_sounds_bytes) {
    if (bytes == 0)
      return {std::min(all_sounds_bytes, kDefaultMaxSounds_bytes), kDefaultPages_bytes,
              kDefaultPages_bytes / 4};
    const std::uint64_t sounds = std::min(all_sounds_bytes, std::max(bytes / 2, kMinSounds_bytes));
    return {sounds, bytes - std::min(sounds, bytes / 2), bytes / 4};
  }
};

}  // namespace clamor
