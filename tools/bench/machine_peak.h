// machine_peak.h: what this core can do at most with the mixer's vectors, to hold kernels against.
#pragma once

namespace clamor {

// Float multiply-adds per second, with vectors of mix_kernel_target()'s length, registers only, and
// loads per second of unaligned floats from L1, by thread CPU time over a few milliseconds.
double peak_multiply_adds_per_s();
double peak_loads_per_s();

}  // namespace clamor
