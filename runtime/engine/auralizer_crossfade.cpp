#include "runtime/engine/auralizer_crossfade.h"

#include <algorithm>
#include <cassert>

#include "common/sample_rate.h"

namespace clamor {

namespace {

constexpr std::uint64_t kFadeFrames = kSampleRate_hz / 10;
constexpr std::size_t kFadePart_frames = 256;  // mixed at a time during a fade

}  // namespace

AuralizerCrossfade::AuralizerCrossfade(Auralizer& first)
    : playing_(&first),
      channels_(static_cast<std::size_t>(first.channels())),
      faded_in_(kFadePart_frames * channels_) {}

void AuralizerCrossfade::fade_to(Auralizer& next, std::uint64_t from_frame) {
  assert(has_faded() && static_cast<std::size_t>(next.channels()) == channels_);
  fade_from_frame_ = from_frame;
  next_.store(&next, std::memory_order_release);
}

void AuralizerCrossfade::mix(std::span<float> interleaved) noexcept {
  Auralizer* const next = next_.load(std::memory_order_acquire);
  const std::uint64_t first_frame = frames_;
  frames_ += interleaved.size() / channels_;
  if (next == nullptr) return playing_->mix(interleaved);
  if (first_frame < fade_from_frame_) {
    const std::uint64_t alone = std::min(fade_from_frame_, frames_) - first_frame;
    playing_->mix(interleaved.first(static_cast<std::size_t>(alone) * channels_));
    interleaved = interleaved.subspan(static_cast<std::size_t>(alone) * channels_);
  }
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

}  // namespace clamor
