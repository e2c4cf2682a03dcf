#include "runtime/audio_callback.h"

#include <algorithm>

namespace clamor {

namespace {

constexpr double kBuffersAhead = 4;  // blocks the device has in hand
constexpr int kSilentBlocks = 2;     // at the end, so that the last sound leaves the device

}  // namespace

void AudioCallback::fill(std::span<float> interleaved, bool underflow) noexcept {
  const auto start = Clock::now();
  const auto channels = static_cast<std::size_t>(auralizer_.channels());
  const auto frames = static_cast<std::uint64_t>(interleaved.size() / channels);
  const double block_s = static_cast<double>(frames) / kSampleRate_hz;

  const std::uint64_t mixed = mixed_.load(std::memory_order_relaxed);
  const std::uint64_t wanted = frames_ == 0 ? frames : std::min(frames, frames_ - mixed);
  const auto sounding = interleaved.first(static_cast<std::size_t>(wanted) * channels);
  if (!sounding.empty()) auralizer_.mix(sounding);
  std::fill(interleaved.begin() + static_cast<std::ptrdiff_t>(sounding.size()), interleaved.end(),
            0.0f);
  if (record_ != nullptr && !sounding.empty()) record_->write(sounding);
  if (meter_ != nullptr && !sounding.empty()) meter_->write(sounding);
  mixed_.store(mixed + wanted, std::memory_order_relaxed);
  if (wanted == 0 && ++silent_blocks_ >= kSilentBlocks)
    finished_.store(true, std::memory_order_release);

  const double took_s = std::chrono::duration<double>(Clock::now() - start).count();
  const double since_last_s = std::chrono::duration<double>(start - last_start_).count();
  const bool first = callbacks_.load(std::memory_order_relaxed) == 0;
  const bool late =
      underflow || took_s > block_s || (!first && since_last_s > (kBuffersAhead + 1) * block_s);
  last_start_ = start;
  if (late) late_.fetch_add(1, std::memory_order_relaxed);
  callbacks_.fetch_add(1, std::memory_order_relaxed);
  const double smoothed = cpu_share_.load(std::memory_order_relaxed);
  cpu_share_.store(smoothed + std::min(1.0, block_s) * (took_s / block_s - smoothed),
                   std::memory_order_relaxed);
}

AudioCallback::Counters AudioCallback::counters() const {
  return {callbacks_.load(std::memory_order_relaxed), late_.load(std::memory_order_relaxed),
          mixed_.load(std::memory_order_relaxed), cpu_share_.load(std::memory_order_relaxed),
          finished_.load(std::memory_order_acquire)};
}

}  // namespace clamor
