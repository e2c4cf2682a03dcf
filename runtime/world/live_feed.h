// live_feed.h: where the samples of a live signal come from: a function that is called for them, or
// a ring that the application writes.
//
// A ring that has run dry, or a function that reports an end, yields silence. Samples that are not
// finite count as 0, and others are clipped to kMaxSample.
//
// Threads: write() on one, which never waits; read() on one other.   Memory: a second of samples.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/result.h"
#include "runtime/mixing/resampler.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

// The largest sample that is taken from the application: 120 dB above full scale.
inline constexpr float kMaxSample = 1e6f;

class LiveFeed {
 public:
  // Fills all samples and returns how many of them are sound; the rest are silence.
  using Pull = std::function<std::size_t(std::span<float>)>;

  // A null `pull` makes a ring. Errors are those of Resampler::create().
  static Result<std::unique_ptr<LiveFeed>> create(int rate_hz, Pull pull);

  // Appends samples to the ring and returns how many fitted.
  std::size_t write(std::span<const float> samples) noexcept REALTIME;

  // Fills `samples` at the mixer's rate.
  void read(std::span<float> samples) noexcept;

  bool is_ring() const noexcept REALTIME { return pull_ == nullptr; }
  std::uint64_t missing_frames() const { return missing_.load(std::memory_order_relaxed); }

 private:
  LiveFeed(Pull pull, std::size_t ring, std::unique_ptr<Resampler> resampler);
  void take(std::span<float> samples) noexcept;

  const Pull pull_;
  std::vector<float> ring_;
  alignas(64) std::atomic<std::uint64_t> written_{0};
  alignas(64) std::atomic<std::uint64_t> read_{0};
  std::atomic<std::uint64_t> missing_{0};
  const std::unique_ptr<Resampler> resampler_;  // null at the mixer's rate
};

}  // namespace clamor
