// machine_peak.h: peak arithmetic and load rates of this core, to which kernels are compared.
#pragma once

namespace clamor {

// Float multiply-adds per second from registers, and unaligned float loads per second from L1, with
// vectors of mix_kernel_target()'s length. Each takes a few milliseconds of thread CPU time.
double peak_multiply_adds_per_s();
double peak_loads_per_s();

}  // namespace clamor
