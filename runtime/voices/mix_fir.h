// mix_fir.h: many rows of samples, each through its own FIR filter, into one sum.
//
//     out[f] = sum over rows r and taps k of filters[r][k] rows[r][f + k]
//
// The last tap multiplies the newest sample. Each frame is summed in the order of rows and taps, so
// the result does not depend on how calls divide time. Highway is visible only in mix_*.cpp.
#pragma once

#include <cstddef>

#include "runtime/realtime/realtime.h"

namespace clamor {

struct FirJob {
  const float* filters;  // [rows][taps]
  const float* rows;     // the oldest sample of the first frame
  std::size_t row_stride;
  int row_count, taps;
  int frames;  // a multiple of 16
  float* out;  // overwritten
};

void sum_filtered(const FirJob& job) noexcept REALTIME;

}  // namespace clamor
