// bench_field.h: the taps with which a field is timed, and what each costs.
//
// 13 signals are heard by as many responses of a second, as in the violin room, by a listener who
// walks at 1.5 m/s: gains and delays of the taps are renewed as they are in a level, and the mixer
// convolves. Choosing the sources of a sample is not part of it.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/voices/mix_kernel.h"

namespace clamor {

struct FieldTiming {
  MixMode mode;
  std::uint32_t taps = 0;
  double renewal_ns = 0;     // of a tap at an ear
  double convolution_s = 0;  // per second, of a signal's response at an ear
  double cpu_s = 0;          // per second, of both for all taps
  double real_time_taps() const { return taps / cpu_s; }
};

// Binaural, and for two receivers.
const std::vector<MixMode>& field_modes();

// Fills in the best of several runs, each of at least `seconds` of CPU time; false if nothing was
// heard.
bool time_field(FieldTiming& figure, double seconds, int runs);

}  // namespace clamor
