// ray_timer.h: adds the CPU time that a thread spends on casting rays to a sum.
#pragma once

#include "common/cpu_time.h"

namespace clamor {

// Measures from construction to destruction, on the constructing thread only.
class RayTimer {
 public:
  explicit RayTimer(double& sum_ms) : sum_ms_(sum_ms), start_s_(thread_time_s()) {}
  ~RayTimer() { sum_ms_ += 1e3 * (thread_time_s() - start_s_); }
  RayTimer(const RayTimer&) = delete;
  RayTimer& operator=(const RayTimer&) = delete;

 private:
  double& sum_ms_;
  const double start_s_;
};

}  // namespace clamor
