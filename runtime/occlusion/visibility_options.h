// visibility_options.h: the options of a visibility cache.
#pragma once

namespace clamor {

inline constexpr int kRaysPerKeyframe = 16000;

struct VisibilityOptions {
  int rays_per_keyframe = kRaysPerKeyframe;
  bool exact = false;  // no budget: all sources that matter have valid estimates
};

}  // namespace clamor
