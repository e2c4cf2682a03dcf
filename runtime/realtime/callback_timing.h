// callback_timing.h: measures how long audio callbacks take and counts late ones.
//
// A callback is late if it takes longer than the block that it fills, if it begins later than the
// device's buffers last, or if the device reports an underflow.
//
// Threads: restart(), begin() and end() run on the thread that currently calls back; counters()
// runs on any.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>

#include "runtime/realtime/realtime.h"

namespace clamor {

class CallbackTiming {
 public:
  using Clock = std::chrono::steady_clock;

  struct Counters {
    std::uint64_t callbacks = 0, late = 0;
    double cpu_share = 0;          // share of real time, smoothed over about a second
    double cpu_s = 0;              // total since the beginning
    std::uint64_t underflows = 0;  // late callbacks that the device reported as underflows
  };

  // Call when another device takes over, so that the gap between the two does not count as late.
  void restart() noexcept REALTIME { last_start_ = {}; }

  void begin(Clock::time_point now, double block_s, bool underflow) noexcept REALTIME {
    const double since_last_s = std::chrono::duration<double>(now - last_start_).count();
    const double longest_s = (kBuffersAhead + 1) * std::max(block_s, block_s_);
    if (underflow) add(underflows_, std::uint64_t{1});
    late_ = underflow || (last_start_ != Clock::time_point{} && since_last_s > longest_s);
    last_start_ = now;
    block_s_ = block_s;
  }

  void end() noexcept REALTIME {
    const double took_s = std::chrono::duration<double>(Clock::now() - last_start_).count();
    if (late_ || took_s > block_s_) add(late_callbacks_, std::uint64_t{1});
    add(callbacks_, std::uint64_t{1});
    add(took_s_, took_s);
    const double smoothed = cpu_share_.load(std::memory_order_relaxed);
    add(cpu_share_, std::min(1.0, block_s_) * (took_s / block_s_ - smoothed));
  }

  Counters counters() const {
    return {callbacks_.load(std::memory_order_relaxed),
            late_callbacks_.load(std::memory_order_relaxed),
            cpu_share_.load(std::memory_order_relaxed), took_s_.load(std::memory_order_relaxed),
            underflows_.load(std::memory_order_relaxed)};
  }

 private:
  static constexpr double kBuffersAhead = 4;  // blocks buffered by the device

  // Adds without a read-modify-write: only one thread writes.
  template <class T>
  static void add(std::atomic<T>& sum, T value) noexcept REALTIME {
    sum.store(sum.load(std::memory_order_relaxed) + value, std::memory_order_relaxed);
  }

  Clock::time_point last_start_{};
  double block_s_ = 0;
  bool late_ = false;
  std::atomic<std::uint64_t> callbacks_{0}, late_callbacks_{0}, underflows_{0};
  std::atomic<double> cpu_share_{0}, took_s_{0};
};

}  // namespace clamor
