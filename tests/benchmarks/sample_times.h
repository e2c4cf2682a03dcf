// sample_times.h: what each of many samples cost the thread that drew it.
//
// By the thread's own clock, so that a loaded machine costs little more than its cold caches; the
// median and the least say more than a mean.
#pragma once

#include <algorithm>
#include <ctime>
#include <vector>

#include <benchmark/benchmark.h>

namespace clamor::testing {

class SampleTimes {
 public:
  template <class Work>
  void time(const Work& work) {
    const double start_ms = now_ms();
    work();
    times_ms_.push_back(now_ms() - start_ms);
  }

  void report(benchmark::State& state) {
    if (times_ms_.empty()) return;
    state.counters["median_ms"] = median_ms();
    state.counters["least_ms"] = times_ms_.front();
  }

  double median_ms() {
    std::sort(times_ms_.begin(), times_ms_.end());
    return times_ms_[times_ms_.size() / 2];
  }

 private:
  static double now_ms() {
    timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
  }

  std::vector<double> times_ms_;
};

}  // namespace clamor::testing
