#include "runtime/engine/keyframe_pacing.h"

#include <algorithm>

namespace clamor {

bool KeyframePacing::made(std::uint64_t number, const WorkTime& spent_s, const WorkTime& part_s,
                          const BlockMixer& mixer) {
  // Only the first keyframe waits for sounds and pages.
  if (number > 0) lead_.made(spent_s.passed, mixer.held_blocks());
  max_lead_s_ = std::max(max_lead_s_, lead_s());
  if (!adapting_ || number < settled_) return false;
  const auto rate = [this] {
    return static_cast<double>(load_.voices()) / static_cast<double>(load_.spacing());
  };
  const double before = rate();
  load_.keyframe_took(part_s * (1 / kKeyframe_s), mixer.shed_share(), mixer.is_full());
  kept_ = std::min(1.0, rate() / before);
  mean_s_ = mean_s_ * kept_;
  return true;
}

}  // namespace clamor
