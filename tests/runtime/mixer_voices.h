// mixer_voices.h: voices for a mixer, and the samples that a mixer makes of them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "runtime/mixing/mixer.h"

namespace clamor::testing {

// A voice with equal gains in both ears and all bands.
inline Voice voice(std::uint32_t slot, double delay_frames, float gain) {
  Voice v;
  v.slot = slot;
  v.starts = true;
  v.start_delay_frames = v.delay_frames = {delay_frames, delay_frames};
  v.gain = {same_in_all_bands(gain), same_in_all_bands(gain)};
  return v;
}

// Both ears, `frames` frames from time 0; keyframe(k) returns keyframe k.
template <class Next>
std::array<std::vector<float>, kEars> heard_of(Mixer& mixer, int frames, Next keyframe) {
  mixer.begin(keyframe(0), 0);
  std::array<std::vector<float>, kEars> out;
  std::vector<float> block(kEars * kStepFrames);
  for (int done = 0, number = 1; done < frames; done += kStepFrames) {
    if (mixer.wants_keyframe()) mixer.load(keyframe(number++));
    mixer.step(block.data());
    for (std::size_t i = 0; i < block.size(); ++i) out[i % kEars].push_back(block[i]);
  }
  return out;
}

}  // namespace clamor::testing
