// mix_reference.h: what mix_kernel.h promises, voice by voice and frame by frame in double
// precision: what every kernel must equal within -100 dB of full scale, and the slow one they are
// timed against.
#pragma once

#include "runtime/voices/mix_kernel.h"

namespace clamor {

struct ReferenceBuses {
  double high[kHighBands * kEars * kMaxFrames];
  double low[kLowBands * kEars * kMaxFrames / kLowRate];
};

// Adds to `buses`; job.high and job.low are not used.
void mix_reference(const MixMode& mode, const MixJob& job, ReferenceBuses& buses);

}  // namespace clamor
