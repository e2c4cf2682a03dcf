#include "runtime/player/audio_callback.h"

#include <algorithm>
#include <cassert>

#include "common/sample_rate.h"

namespace clamor {

namespace {

constexpr int kSilentBlocks = 2;  // at the end, so that the last sound leaves the device

constexpr std::uint64_t kFadeFrames = kSampleRate_hz / 10;
constexpr std::size_t kFadePart_frames = 256;  // mixed at a time during a fade

}  // namespace

AudioCallback::AudioCallback(Auralizer& auralizer, SampleRing* record, std::uint64_t frames,
                             SampleRing* meter)
    : playing_(&auralizer),
      channels_(static_cast<std::size_t>(auralizer.channels())),
      faded_in_(kFadePart_frames * channels_),
      record_(record),
      meter_(meter),
      frames_(frames) {}

void AudioCallback::fade_to(Auralizer& next) {
  assert(has_faded() && static_cast<std::size_t>(next.channels()) == channels_);
  next_.store(&next, std::memory_order_release);
}

void AudioCallback::mix(std::span<float> interleaved) noexcept {
  Auralizer* const next = next_.load(std::memory_order_acquire);
  if (next == nullptr) return playing_->mix(interleaved);
  while (!interleaved.empty()) {
    const auto before = interleaved.first(std::min(interleaved.size(), faded_in_.size()));
    const auto after = std::span(faded_in_).first(before.size());
    playing_->mix(before);
    next->mix(after);
    for (std::size_t i = 0; i < before.size(); ++i) {
      const auto frame = static_cast<float>(faded_frames_ + i / channels_ + 1);
      before[i] += std::min(frame / kFadeFrames, 1.0f) * (after[i] - before[i]);
    }
    faded_frames_ += before.size() / channels_;
    interleaved = interleaved.subspan(before.size());
  }
  if (faded_frames_ < kFadeFrames) return;
  faded_frames_ = 0;
  playing_ = next;
  next_.store(nullptr, std::memory_order_release);
}

void AudioCallback::fill(std::span<float> interleaved) noexcept {
  const std::size_t channels = channels_;
  const auto frames = static_cast<std::uint64_t>(interleaved.size() / channels);

  const std::uint64_t mixed = mixed_.load(std::memory_order_relaxed);
  const std::uint64_t wanted = frames_ == 0 ? frames : std::min(frames, frames_ - mixed);
  const auto sounding = interleaved.first(static_cast<std::size_t>(wanted) * channels);
  if (!sounding.empty()) mix(sounding);
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
