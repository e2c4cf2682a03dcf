#include "runtime/streaming/live_signal.h"

#include <algorithm>
#include <cmath>

#include "common/sample_rate.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxAppended_frames = 4096;  // at a time
constexpr std::int64_t kSafety_frames = kSampleRate_hz;

}  // namespace

LiveSignal::LiveSignal(const MixMode& mode, std::int64_t first)
    : signal_(PreparedSignal::live(mode)),
      window_(PreparedSignal::kLiveWindow_frames),
      end_(first) {
  signal_.set_live_range(first - kRing_frames + kSafety_frames, first);
}

void LiveSignal::append(std::span<const float> samples) {
  while (!samples.empty()) {
    const auto some = samples.first(std::min(kMaxAppended_frames, samples.size()));
    for (const float sample : some)
      window_.push_back(std::isfinite(sample) ? static_cast<double>(sample) : 0);
    prepare();
    samples = samples.subspan(some.size());
  }
}

// Prepares all whole steps of the low layer that have enough samples behind them.
void LiveSignal::prepare() {
  constexpr std::size_t kAround = 2 * PreparedSignal::kLiveWindow_frames;
  if (window_.size() < kAround + kLowRate) return;
  const std::size_t frames = (window_.size() - kAround) / kLowRate * kLowRate;
  const std::int64_t first = end_;
  end_ += static_cast<std::int64_t>(frames);
  const std::int64_t oldest = end_ - kRing_frames;  // that is not overwritten
  signal_.set_live_range(oldest + kSafety_frames, first);
  signal_.make_live(
      first, frames,
      {window_.begin(), window_.begin() + static_cast<std::ptrdiff_t>(frames + kAround)});
  signal_.set_live_range(oldest + kSafety_frames, end_);
  window_.erase(window_.begin(), window_.begin() + static_cast<std::ptrdiff_t>(frames));
}

}  // namespace clamor
