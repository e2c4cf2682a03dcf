#include "tools/bench/machine_peak.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "common/cpu_time.h"

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tools/bench/machine_peak.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kRounds = 40000;

// Returns the number of floats multiplied and added.
double multiply_add_here(float* sink) {
  const hn::CappedTag<float, 16> d;
  constexpr int kChains = 10;
  hn::Vec<decltype(d)> sum[kChains];
  for (int i = 0; i < kChains; ++i) sum[i] = hn::Set(d, 1.0f + static_cast<float>(i));
  const auto a = hn::Set(d, 0.999f), b = hn::Set(d, 0.001f);
  for (int r = 0; r < kRounds; ++r)
    for (int i = 0; i < kChains; ++i) sum[i] = hn::MulAdd(sum[i], a, b);
  for (int i = 0; i < kChains; ++i) *sink += hn::GetLane(sum[i]);
  return 1.0 * kRounds * kChains * static_cast<double>(hn::Lanes(d));
}

// Returns the number of floats loaded.
double load_here(float* sink) {
  const hn::CappedTag<float, 16> d;
  constexpr int kChains = 8;
  static float memory[1024 + 64];
  const int lanes = static_cast<int>(hn::Lanes(d));
  hn::Vec<decltype(d)> sum[kChains];
  for (int i = 0; i < kChains; ++i) sum[i] = hn::Zero(d);
  for (int r = 0; r < kRounds; ++r) {
    const float* x = memory + (r * 8 * lanes) % 896 + 1;
    for (int i = 0; i < kChains; ++i) sum[i] = hn::Max(sum[i], hn::LoadU(d, x + i * lanes));
  }
  for (int i = 0; i < kChains; ++i) *sink += hn::GetLane(sum[i]);
  return 1.0 * kRounds * kChains * static_cast<double>(hn::Lanes(d));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {

HWY_EXPORT(multiply_add_here);
HWY_EXPORT(load_here);

template <class Work>
double best_per_s(Work work) {
  float sink = 0;
  double best = 0;
  for (int i = 0; i < 15; ++i) {
    const double start = thread_time_s();
    const double done = work(&sink);
    best = std::max(best, done / (thread_time_s() - start));
  }
  if (!(sink > -1)) std::abort();
  return best;
}

}  // namespace

double peak_multiply_adds_per_s() {
  return best_per_s([](float* sink) { return HWY_DYNAMIC_DISPATCH(multiply_add_here)(sink); });
}

double peak_loads_per_s() {
  return best_per_s([](float* sink) { return HWY_DYNAMIC_DISPATCH(load_here)(sink); });
}

}  // namespace clamor

#endif  // HWY_ONCE
