// mix_reference.h: a scalar reference for mix_kernel.h in double precision. Every kernel must match
// it within -100 dB of full scale; benchmarks compare against its speed.
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
