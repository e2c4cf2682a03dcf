// wanted_sound.h: the sound of a source that is not chosen because it is not in memory.
#pragma once

#include <cstdint>

namespace clamor {

struct WantedSound {
  std::uint32_t signal = 0;
  double delay_s = 0;
  float power = 0;  // as sampled, loudness-weighted
};

}  // namespace clamor
