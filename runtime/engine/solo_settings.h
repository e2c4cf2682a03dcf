// solo_settings.h: listens to a part of the sound: to some bands, or to direct, early or late
// sound.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/bands.h"

namespace clamor {

// Parts of the sound of an emitter by the time at which they arrive: the emitter itself, what is
// reflected and at most kEarly_s behind it, and the rest.
enum class SoundPart : std::uint8_t { kDirect, kEarly, kLate };
inline constexpr std::size_t kSoundParts = 3;
inline constexpr double kEarly_s = 0.08;  // as in C80, ISO 3382-1

// Factors of the power.
struct SoloSettings {
  Bands bands = same_in_all_bands(1);
  std::array<float, kSoundParts> parts{1, 1, 1};

  bool is_neutral() const { return *this == SoloSettings(); }
  bool operator==(const SoloSettings&) const = default;
};

}  // namespace clamor
