#include "runtime/world/live_feed.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/sample_rate.h"

namespace clamor {

LiveFeed::LiveFeed(Pull pull, std::size_t ring, std::unique_ptr<Resampler> resampler)
    : pull_(std::move(pull)), ring_(ring), resampler_(std::move(resampler)) {}

Result<std::unique_ptr<LiveFeed>> LiveFeed::create(int rate_hz, Pull pull) {
  std::unique_ptr<Resampler> resampler;
  if (rate_hz != kSampleRate_hz) {
    auto made = Resampler::create(1, rate_hz, kSampleRate_hz);
    if (!made.ok()) return made.error();
    resampler = std::move(*made);
  }
  const std::size_t ring = pull == nullptr ? static_cast<std::size_t>(rate_hz) : 0;
  return std::unique_ptr<LiveFeed>(new LiveFeed(std::move(pull), ring, std::move(resampler)));
}

std::size_t LiveFeed::write(std::span<const float> samples) noexcept {
  const std::uint64_t written = written_.load(std::memory_order_relaxed);
  const std::uint64_t waiting = written - read_.load(std::memory_order_acquire);
  const std::size_t count =
      std::min(samples.size(), ring_.size() - static_cast<std::size_t>(waiting));
  for (std::size_t i = 0; i < count; ++i) ring_[(written + i) % ring_.size()] = samples[i];
  written_.store(written + count, std::memory_order_release);
  return count;
}

void LiveFeed::take(std::span<float> samples) noexcept {
  std::size_t count = 0;
  if (pull_ != nullptr) {
    count = std::min(pull_(samples), samples.size());
  } else {
    const std::uint64_t read = read_.load(std::memory_order_relaxed);
    const std::uint64_t waiting = written_.load(std::memory_order_acquire) - read;
    count = std::min(samples.size(), static_cast<std::size_t>(waiting));
    for (std::size_t i = 0; i < count; ++i) samples[i] = ring_[(read + i) % ring_.size()];
    read_.store(read + count, std::memory_order_release);
  }
  for (float& sample : samples.first(count))
    sample = std::isfinite(sample) ? std::clamp(sample, -kMaxSample, kMaxSample) : 0;
  std::fill(samples.begin() + static_cast<std::ptrdiff_t>(count), samples.end(), 0.0f);
  missing_.fetch_add(samples.size() - count, std::memory_order_relaxed);
}

void LiveFeed::read(std::span<float> samples) noexcept {
  if (resampler_ == nullptr) return take(samples);
  const auto fill = [](void* feed, std::span<float> block) noexcept {
    static_cast<LiveFeed*>(feed)->take(block);
  };
  resampler_->read(samples, {fill, this});
}

}  // namespace clamor
