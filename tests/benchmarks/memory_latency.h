// memory_latency.h: current latency of a read from memory.
//
// A keyframe mostly waits for memory, and on a shared machine a read takes several times as long as
// on an idle one; benchmarks report this latency beside their results.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/random.h"

namespace clamor::testing {

// Latency of dependent reads over 256 MB.
inline double memory_latency_ns() {
  constexpr std::uint32_t kLines = 1 << 22, kPerLine = 64 / sizeof(std::uint32_t);
  constexpr int kReads = 200'000;
  std::vector<std::uint32_t> order(kLines), next(std::size_t{kLines} * kPerLine);
  std::iota(order.begin(), order.end(), 0u);
  for (std::uint32_t i = kLines - 1; i > 0; --i)
    std::swap(order[i], order[philox(1, {i, 0, 0, 0})[0] % (i + 1)]);
  for (std::uint32_t i = 0; i < kLines; ++i)
    next[std::size_t{order[i]} * kPerLine] = order[(i + 1) % kLines];
  std::uint32_t at = 0;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < kReads; ++i) at = next[std::size_t{at} * kPerLine];
  const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - start;
  benchmark::DoNotOptimize(at);
  return took.count() / kReads;
}

}  // namespace clamor::testing
