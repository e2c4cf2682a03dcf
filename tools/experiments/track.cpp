#include "tools/experiments/track.h"

#include <array>
#include <utility>

namespace clamor {

Track::Track(const RadiationModel& radiation, const std::vector<PreparedSignal>& signals,
             Sampler& sampler, ListenerAt listener, std::uint64_t first_keyframe)
    : sampler_(sampler),
      listener_(std::move(listener)),
      maker_(radiation, 3 * sampler.capacity()),
      mixer_(signals, 3 * sampler.capacity()),
      number_(first_keyframe) {
  keyframe_.voices.reserve(3 * sampler.capacity());
  make_keyframe();
  mixer_.begin(keyframe_, static_cast<std::int64_t>(first_keyframe) * kKeyframeFrames);
}

void Track::make_keyframe() {
  const Listener listener = motion_.next(listener_(time_s()));
  maker_.make(sampler_.sample(listener, time_s()), listener, keyframe_);
}

const Keyframe& Track::next(Sound& sound) {
  ++number_;
  make_keyframe();
  mixer_.load(keyframe_);
  std::array<float, kEars * kMaxFrames> mixed;
  for (int done = 0; done < kKeyframeFrames;) {
    const int steps = mixer_.steps_left();
    mixer_.mix(mixed.data(), steps);
    for (std::size_t f = 0; f < static_cast<std::size_t>(steps) * kStepFrames; ++f)
      for (std::size_t e = 0; e < kEars; ++e) sound.channels[e].push_back(mixed[f * kEars + e]);
    done += steps * kStepFrames;
  }
  return keyframe_;
}

}  // namespace clamor
