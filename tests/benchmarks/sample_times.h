// sample_times.h: CPU time of each of many samples on the thread that draws them.
//
// CPU time excludes the load of the machine except for cold caches. The median and the minimum are
// more stable than a mean.
#pragma once

#include <algorithm>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/cpu_time.h"

namespace clamor::testing {

class SampleTimes {
 public:
  template <class Work>
  void time(const Work& work) {
    const double start_s = thread_time_s();
    work();
    times_ms_.push_back(1e3 * (thread_time_s() - start_s));
  }

  void report(benchmark::State& state) {
    if (times_ms_.empty()) return;
    state.counters["median_ms"] = median_ms();
    state.counters["min_ms"] = times_ms_.front();
  }

  double median_ms() {
    std::sort(times_ms_.begin(), times_ms_.end());
    return times_ms_[times_ms_.size() / 2];
  }

 private:
  std::vector<double> times_ms_;
};

}  // namespace clamor::testing
