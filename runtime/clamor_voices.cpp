// clamor_voices.cpp: what the C interface tells of a listener's voices.
#include <algorithm>
#include <cmath>

#include "common/c_structures.h"
#include "common/sample_rate.h"
#include "runtime/clamor.h"
#include "runtime/clamor_context.h"
#include "runtime/voices/keyframe.h"
#include "runtime/world/world_listener.h"

namespace {

using clamor::copy_from_caller;
using clamor::copy_to_caller;
using clamor::interface::guarded;
using clamor::interface::is_missing;
using clamor::interface::refuse;

constexpr std::uint32_t kNoLevelSound = 0xffffffff;

// The ears of a voice have equal gains, unless they are receivers of their own.
clamor_voice told(const clamor::Voice& voice) {
  clamor_voice made{};
  made.slot = voice.slot;
  made.starts = voice.starts;
  const clamor::Vec3f& from = voice.from;  // ahead, left, up
  made.direction[0] = -from.y;
  made.direction[1] = from.z;
  made.direction[2] = -from.x;
  made.delay_s = (voice.delay_frames[0] + voice.delay_frames[1]) / 2 / clamor::kSampleRate_hz;
  for (std::size_t b = 0; b < clamor::kBandCount; ++b) {
    const float left = voice.gain[0][b], right = voice.gain[1][b];
    made.band_gains[b] = std::copysign(std::sqrt((left * left + right * right) / 2), left);
  }
  return made;
}

}  // namespace

extern "C" clamor_result clamor_get_voices(clamor_context* context, clamor_listener listener,
                                           clamor_voices* voices) {
  return guarded(nullptr, [&]() -> clamor_result {
    clamor_voices chosen;
    if (is_missing(context) || voices == nullptr || !copy_from_caller(voices, chosen) ||
        (chosen.capacity > 0 && chosen.voices == nullptr))
      return refuse(context, voices);
    const auto asked = context->world.listener(listener);
    if (asked == nullptr) return CLAMOR_ERROR_HANDLE;
    if (!asked->reports_voices()) return CLAMOR_ERROR_STATE;
    chosen.count = 0;
    asked->visit_voices([&](const clamor::Keyframe& keyframe, double time_s,
                            std::uint32_t first_slot, const auto& sound_of) {
      chosen.count = static_cast<std::uint32_t>(keyframe.voices.size());
      chosen.time_s = time_s;
      for (std::uint32_t i = 0; i < std::min(chosen.count, chosen.capacity); ++i) {
        const clamor::Voice& voice = keyframe.voices[i];
        clamor_voice& made = chosen.voices[i] = told(voice);
        const bool is_of_level = voice.signal < first_slot;
        made.level_sound = is_of_level ? voice.signal : kNoLevelSound;
        if (!is_of_level) made.sound = sound_of((voice.signal - first_slot) / 2);
      }
    });
    return copy_to_caller(chosen, voices) ? CLAMOR_OK : refuse(context, voices);
  });
}
