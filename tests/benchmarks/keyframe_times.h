// keyframe_times.h: CPU time of keyframes, divided into rays and everything else.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/cpu_time.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/voices/keyframe.h"
#include "tests/benchmarks/memory_latency.h"

namespace clamor::testing {

// Times of keyframes without their rays, and of the rays: those of the last walk, and the shortest
// of each keyframe over repeated walks.
class KeyframeTimes {
 public:
  void begin_walk() {
    rest_ms_.clear();
    rays_ms_ = 0;
  }
  template <class Keyframe>
  void time(const VisibilityCache& cache, const Keyframe& keyframe) {
    const double start_s = thread_time_s(), cast_ms = cache.statistics().ray_ms;
    keyframe();
    const double ray_ms = cache.statistics().ray_ms - cast_ms;
    const double rest_ms = 1e3 * (thread_time_s() - start_s) - ray_ms;
    const std::size_t k = rest_ms_.size();
    if (k == min_ms_.size()) min_ms_.push_back(rest_ms);
    min_ms_[k] = std::min(min_ms_[k], rest_ms);
    rest_ms_.push_back(rest_ms);
    rays_ms_ += ray_ms;
  }

  void report(benchmark::State& state) {
    const auto count = static_cast<double>(rest_ms_.size());
    std::sort(rest_ms_.begin(), rest_ms_.end());
    state.counters["rays_ms"] = rays_ms_ / count;
    state.counters["rest_ms"] = rest_ms_[rest_ms_.size() / 2];
    state.counters["rest_mean_ms"] = std::accumulate(rest_ms_.begin(), rest_ms_.end(), 0.0) / count;
    state.counters["rest_p95_ms"] = rest_ms_[rest_ms_.size() * 19 / 20];
    state.counters["memory_ns"] = testing::memory_latency_ns();
  }

  double median_of_min_ms() const {
    std::vector<double> sorted = min_ms_;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }

 private:
  std::vector<double> rest_ms_, min_ms_;
  double rays_ms_ = 0;
};

}  // namespace clamor::testing
