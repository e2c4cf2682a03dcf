// sample_ring.h: a lock-free ring buffer of samples for one writer and one reader.
//
// Carries samples from the audio thread to a thread that writes files. The capacity is fixed;
// samples that do not fit are dropped and counted, because the audio thread does not wait.
//
// Threads: write() on one thread, read() on one other.   Memory: the capacity, allocated once.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/realtime/realtime.h"

namespace clamor {

class SampleRing {
 public:
  explicit SampleRing(std::size_t capacity) : samples_(capacity) {}

  // Writes all samples or, if they do not fit, none.
  void write(std::span<const float> samples) noexcept REALTIME {
    const std::uint64_t written = written_.load(std::memory_order_relaxed);
    const std::uint64_t used = written - read_.load(std::memory_order_acquire);
    if (samples.size() > samples_.size() - used) {
      dropped_.fetch_add(samples.size(), std::memory_order_relaxed);
      return;
    }
    for (std::size_t i = 0; i < samples.size(); ++i)
      samples_[(written + i) % samples_.size()] = samples[i];
    written_.store(written + samples.size(), std::memory_order_release);
  }

  // Reads up to samples.size() samples; returns how many.
  std::size_t read(std::span<float> samples) noexcept {
    const std::uint64_t read = read_.load(std::memory_order_relaxed);
    const std::uint64_t there = written_.load(std::memory_order_acquire) - read;
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(there, samples.size()));
    for (std::size_t i = 0; i < count; ++i) samples[i] = samples_[(read + i) % samples_.size()];
    read_.store(read + count, std::memory_order_release);
    return count;
  }

  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::vector<float> samples_;
  alignas(64) std::atomic<std::uint64_t> written_{0};
  alignas(64) std::atomic<std::uint64_t> read_{0};
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace clamor
