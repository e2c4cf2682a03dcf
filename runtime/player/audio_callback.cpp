#include "runtime/player/audio_callback.h"

#include <algorithm>

namespace clamor {

namespace {

constexpr int kSilentBlocks = 2;  // at the end, so that the last sound leaves the device

}  // namespace

AudioCallback::AudioCallback(Auralizer& auralizer, SampleRing* record, std::uint64_t frames,
                             SampleRing* meter)
    : playing_(auralizer), record_(record), meter_(meter), frames_(frames) {}

void AudioCallback::fill(std::span<float> interleaved) noexcept {
  const std::size_t channels = playing_.channels();
  const auto frames = static_cast<std::uint64_t>(interleaved.size() / channels);

  const std::uint64_t mixed = mixed_.load(std::memory_order_relaxed);
  const std::uint64_t wanted = frames_ == 0 ? frames : std::min(frames, frames_ - mixed);
  const auto sounding = interleaved.first(static_cast<std::size_t>(wanted) * channels);
  if (!sounding.empty()) playing_.mix(sounding);
  std::fill(interleaved.begin() + static_cast<std::ptrdiff_t>(sounding.size()), interleaved.end(),
            0.0f);
  if (record_ != nullptr && !sounding.empty()) record_->write(sounding);
  if (meter_ != nullptr && !sounding.empty()) meter_->write(sounding);
  mixed_.store(mixed + wanted, std::memory_order_relaxed);
  if (wanted == 0 && ++silent_blocks_ >= kSilentBlocks)
    finished_.store(true, std::memory_order_release);
}

AudioCallback::Counters AudioCallback::counters() const {
  return {mixed_.load(std::memory_order_relaxed), finished_.load(std::memory_order_acquire)};
}

}  // namespace clamor
