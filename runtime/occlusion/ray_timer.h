// ray_timer.h: adds the time a thread spends on rays to a sum.
#pragma once

#include "common/thread_time.h"

namespace clamor {

// Of this thread, whatever others do.
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
