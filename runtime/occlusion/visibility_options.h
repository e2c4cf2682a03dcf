// visibility_options.h: the options of a visibility cache.
#pragma once

#include "runtime/propagation/tolerances.h"

namespace clamor {

struct VisibilityOptions {
  int rays_per_keyframe = kRaysPerKeyframe;
  bool exact = false;  // no budget: all sources that matter have valid estimates
};

}  // namespace clamor
