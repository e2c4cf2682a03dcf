// world_listener.h: one of the listeners of a world: what it hears of a level, at any sample rate,
// and the crossfade when it enters another level.
//
// Threads: render() on one at a time, the audio thread; all others on any.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "common/listener.h"
#include "common/result.h"
#include "common/sample_rate.h"
#include "runtime/engine/auralizer_crossfade.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/mixing/resampler.h"
#include "runtime/realtime/latest_value.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class BakeFile;

class WorldListener {
 public:
  struct Options {
    AuralizerOptions auralizer;
    int rate_hz = kSampleRate_hz;  // of the output
    Listener listener;             // at first
  };

  // Errors are those of Auralizer::create() and Resampler::create().
  static Result<std::shared_ptr<WorldListener>> create(std::shared_ptr<const BakeFile> level,
                                                       const Options& options);
  ~WorldListener();

  // Crossfades to another level in a tenth of a second, once a fade under way has ended. Takes as
  // long as opening the level, during which the old one plays on. After an Error it plays on, too.
  Result<void> enter(std::shared_ptr<const BakeFile> level);

  void move(const Listener& listener) {
    const std::lock_guard lock(moving_);
    moved_.publish(listener);
  }

  AuralizerStatistics statistics();

  // Makes the keyframes that are wanted now, at most one for each level that is heard. Returns
  // whether it made any.
  bool make_keyframes();
  // The time that the next keyframe of the level is for, in seconds since the level was entered, if
  // one is wanted.
  std::optional<double> wanted_keyframe_s();
  // Loads one page or one piece of a sound, for auralizers without threads; false if none is
  // requested.
  bool load();

  std::size_t channels() const noexcept REALTIME { return mixed_.channels(); }
  // Overwrites any number of frames of all channels.
  void render(std::span<float> interleaved) noexcept REALTIME;
  // As above, into one array of `frames` samples for each channel.
  void render(float* const* planes, std::size_t frames) noexcept REALTIME;

 private:
  WorldListener(std::unique_ptr<Auralizer> first, const Options& options,
                std::unique_ptr<Resampler> resampler);
  static void make_first_keyframes(Auralizer& auralizer, const Listener& listener);

  const AuralizerOptions options_;
  std::mutex making_;  // held by the sampler at work, and while the caller changes what it works on
  std::unique_ptr<Auralizer> current_;
  std::unique_ptr<Auralizer> outgoing_;  // during a fade
  std::unique_ptr<Auralizer> incoming_;  // once that fade has ended
  std::mutex moving_;                    // held by move() alone, which does not wait for a keyframe
  LatestValue<Listener> moved_;

  // Used by the audio thread.
  AuralizerCrossfade mixed_;
  const std::unique_ptr<Resampler> resampler_;  // null at the mixer's rate
  std::vector<float> part_;                     // of a block, interleaved
};

}  // namespace clamor
