#include "tools/view/sound_history.h"

#include <algorithm>
#include <cmath>

#include "common/sample_rate.h"

namespace clamor {

void SoundHistory::add(std::span<const float> interleaved) {
  const std::lock_guard lock(mutex_);
  for (const float sample : interleaved) {
    sum_ += sample;
    if (++part_ < channels_) continue;
    // Channels are about as loud as each other and mostly not alike, so that powers add.
    waiting_.push_back(sum_ / std::sqrt(static_cast<float>(channels_)));
    part_ = 0;
    sum_ = 0;
  }
  // Nobody looks: only the newest columns matter.
  constexpr auto kMost = static_cast<std::size_t>(kSampleRate_hz);
  if (waiting_.size() > kMost)
    waiting_.erase(waiting_.begin(), waiting_.end() - static_cast<std::ptrdiff_t>(kMost));
}

void SoundHistory::update() {
  constexpr auto kColumn_frames = static_cast<std::size_t>(kColumn_s * kSampleRate_hz);
  std::vector<float> fresh;
  {
    const std::lock_guard lock(mutex_);
    fresh.swap(waiting_);
  }
  for (std::size_t at = 0; at < fresh.size();) {
    const std::size_t count = std::min(fresh.size() - at, kColumn_frames - since_column_);
    const auto first = fresh.begin() + static_cast<std::ptrdiff_t>(at);
    window_.insert(window_.end(), first, first + static_cast<std::ptrdiff_t>(count));
    at += count;
    since_column_ += count;
    if (since_column_ < kColumn_frames) break;
    since_column_ = 0;
    if (window_.size() < kWindow_frames) continue;
    window_.erase(window_.begin(), window_.end() - static_cast<std::ptrdiff_t>(kWindow_frames));
    const Spectrogram heard = spectrogram_of({{window_}}, 1);
    Column column{};
    for (std::size_t band = 0; band < column.size(); ++band)
      column[band] = static_cast<float>(heard.power.front()[band]);
    columns_.push_back(column);
    while (static_cast<double>(columns_.size()) * kColumn_s > kSeconds) columns_.pop_front();
  }
}

}  // namespace clamor
