// sound_history.h: the last seconds of what was played, as a spectrogram and as levels.
//
// Threads: add() on one thread, all others on one other.
#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <mutex>
#include <span>
#include <vector>

#include "tools/analysis/spectrogram.h"

namespace clamor {

class SoundHistory {
 public:
  static constexpr double kColumn_s = 0.1, kSeconds = 12;
  using Column = std::array<float, kThirdOctaves>;  // mean power per third octave, of all channels

  explicit SoundHistory(int channels) : channels_(static_cast<std::size_t>(channels)) {}

  // Takes interleaved samples.
  void add(std::span<const float> interleaved);

  // Computes the columns that are due; call often. A column takes a millisecond.
  void update();
  // The newest last.
  const std::deque<Column>& columns() const { return columns_; }

 private:
  static constexpr std::size_t kWindow_frames = 16384;  // that of spectrogram_of()

  const std::size_t channels_;
  std::mutex mutex_;            // guards what follows
  std::vector<float> waiting_;  // mono, not yet taken by update()
  std::size_t part_ = 0;        // samples of the next frame that were added
  float sum_ = 0;

  std::vector<float> window_;     // of update(), the newest last
  std::size_t since_column_ = 0;  // frames
  std::deque<Column> columns_;
};

}  // namespace clamor
