// heard_source.h: a source that a keyframe was made from, for displays.
#pragma once

#include <cstdint>

#include "common/vec.h"
#include "runtime/engine/solo_settings.h"

namespace clamor {

struct HeardSource {
  std::uint64_t number = 0;
  Vec3f position_m{};
  float power = 0;       // at the listener, summed over bands, as it is mixed
  float power_gain = 1;  // by occlusion, portals and its emitter, in the clearest band
  std::uint32_t emitter = 0;
  SoundPart part = SoundPart::kDirect;
};

}  // namespace clamor
