// live_signal.h: a signal whose samples arrive while it plays: speech, a synthesiser, the mix of
// another engine.
//
// Samples are prepared as they arrive, like those of other
// signals (prepared_signal.h), except that the octave filter bank keeps its phase. The layer split
// and the spline look ahead, so a frame can be read 27 ms after it has arrived. Voices with delays
// of up to 1.6 s, 550 m, read the same ring.
//
// The range that may be read ends a second before the oldest frame that append() overwrites, so a
// reader who has checked the range has long finished. A thread that is stopped for that second in
// the middle of a segment would hear newer samples.
//
// Threads: append() on one at a time; audio threads read signal().   Memory: 0.7 MB.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/streaming/prepared_signal.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

class LiveSignal {
 public:
  // A frame can be read once so many more have arrived.
  static constexpr std::int64_t kLatency_frames = PreparedSignal::kLiveWindow_frames + kLowRate;

  // `first` is the number of the frame that arrives first, a multiple of kLowRate.
  explicit LiveSignal(const MixMode& mode, std::int64_t first = 0);

  // Appends samples at the mixer's rate. Samples that are not finite count as 0.
  void append(std::span<const float> samples);

  const PreparedSignal& signal() const { return signal_; }
  std::int64_t end() const { return end_; }  // of the frames that can be read

 private:
  void prepare();

  PreparedSignal signal_;
  std::vector<double> window_;  // samples from kLiveWindow_frames before the end on
  std::int64_t end_;
};

}  // namespace clamor
