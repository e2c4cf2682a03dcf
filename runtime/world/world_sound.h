// world_sound.h: a sound of a world, which any number of sources play: samples in memory, or a live
// feed.
//
// A sound is prepared once for each mode of mixing, and all listeners of that mode read the same
// samples.
//
// Threads: any.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "formats/level/signal.h"
#include "runtime/engine/replaceable_signals.h"
#include "runtime/streaming/live_signal.h"
#include "runtime/world/live_feed.h"

namespace clamor {

class WorldSound {
 public:
  explicit WorldSound(Signal signal);
  explicit WorldSound(std::unique_ptr<LiveFeed> feed);

  bool is_live() const { return feed_ != nullptr; }
  // The length of a sound that plays once, or infinity.
  double duration_s() const;
  LiveFeed* feed() const { return feed_.get(); }

  // The sound for an auralizer of this mode, prepared if it was not yet, which takes 3 ms for each
  // second of sound.
  SlotSignal for_mode(const MixMode& mode);

  // For a live sound: reads the feed until frame `end` can be read in every mode.
  void produce(std::int64_t end);
  std::int64_t produced() const;  // frames
  LoudnessTrack live_weights() const;

 private:
  struct Prepared {
    MixMode mode;
    std::shared_ptr<const PreparedSignal> signal, onset;  // of samples
    std::shared_ptr<LiveSignal> live;                     // or of a feed
  };

  const Signal signal_;
  const LoudnessTrack weights_;           // of samples
  const std::unique_ptr<LiveFeed> feed_;  // null for samples

  LoudnessTrack weights_now() const;  // live_weights() under the mutex

  mutable std::mutex mutex_;  // guards what follows
  std::vector<Prepared> prepared_;
  std::int64_t arrived_ = 0;
  double mean_square_ = 0;  // of what a feed plays, which falls within two seconds
};

}  // namespace clamor
