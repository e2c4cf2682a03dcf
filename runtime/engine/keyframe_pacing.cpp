#include "runtime/engine/keyframe_pacing.h"

namespace clamor {

bool KeyframePacing::made(std::uint64_t number, double spent_s, double own_s,
                          const BlockMixer& mixer) {
  // Only the first keyframe waits for sounds and pages.
  if (number > 0) lead_.made(spent_s, mixer.held_blocks());
  if (!adapting_ || number < settled_) return false;
  load_.keyframe_took(own_s * kSampleRate_hz / kKeyframeFrames, mixer.shed_share(),
                      mixer.is_full());
  return true;
}

}  // namespace clamor
