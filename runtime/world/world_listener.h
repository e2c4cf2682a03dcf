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
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_crossfade.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/mixing/resampler.h"
#include "runtime/realtime/latest_value.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/mix_kernel.h"
#include "runtime/world/source_mirror.h"

namespace clamor {

class BakeFile;

class WorldListener {
 public:
  // A level and its handle.
  struct Place {
    std::shared_ptr<const BakeFile> level;
    std::uint64_t handle = 0;
  };

  struct Options {
    AuralizerOptions auralizer;
    int rate_hz = kSampleRate_hz;     // of the output
    Listener listener;                // at first
    WorldSources* sources = nullptr;  // of the world; must outlive the listener
  };

  // Errors are those of Auralizer::create() and Resampler::create().
  static Result<std::shared_ptr<WorldListener>> create(const Place& place, const Options& options);
  ~WorldListener();

  // Crossfades to another level in a tenth of a second, once a fade under way has ended. Signals
  // that loop go on as if the listener had always been there. Takes as long as opening the level,
  // during which the old one plays on. After an Error it plays on, too.
  Result<void> enter(const Place& place);

  void move(const Listener& listener) {
    const std::lock_guard lock(moving_);
    moved_.publish(listener);
  }

  AuralizerStatistics statistics();

  // Calls act(keyframe, time_s, first_slot, sound_of) with the newest keyframe, unless there is
  // none yet. Its signals from `first_slot` on are the application's sounds: sound_of(slot) is a
  // handle.
  bool reports_voices() const { return options_.auralizer.keeps_keyframe; }
  template <class Act>
  void visit_voices(const Act& act) {
    const std::lock_guard lock(making_);
    const Auralizer& auralizer = *current_.auralizer;
    const Keyframe* const keyframe = auralizer.newest_keyframe();
    if (keyframe == nullptr) return;
    act(*keyframe, auralizer.newest_keyframe_time_s(), auralizer.signal_slots().signal_of(0),
        [this](std::size_t slot) { return current_.sources->sound_of(slot); });
  }
  const MixMode& mode() const { return mode_; }  // of all levels

  // Makes the keyframes that are wanted now, at most one for each level that is heard. Returns
  // whether it made any.
  bool make_keyframes();
  // The time that the next keyframe is for, if one is wanted: in seconds since the listener was
  // created if it is offline, since it entered its level otherwise.
  std::optional<double> wanted_keyframe_s();
  // Loads one page or one piece of a sound, for auralizers without threads; false if none is
  // requested.
  bool load();

  std::size_t channels() const noexcept REALTIME { return mixed_.channels(); }
  // Overwrites any number of frames of all channels.
  void render(std::span<float> interleaved) noexcept REALTIME;
  // Does the same into one array of `frames` samples for each channel.
  void render(float* const* planes, std::size_t frames) noexcept REALTIME;

 private:
  // The auralizer of a level and the application's sources in it.
  struct Ears {
    std::unique_ptr<Auralizer> auralizer;
    std::unique_ptr<SourceMirror> sources;
    double begins_s = 0;  // since the listener was created
  };

  WorldListener(Ears first, const Options& options, std::unique_ptr<Resampler> resampler);
  static Result<Ears> listen(const Place& place, const Options& options, double begins_s);
  static bool make_keyframe(Ears& ears, const Listener& listener);
  static void make_first_keyframes(Ears& ears, const Listener& listener);
  double time_s() const;  // of the next keyframe, since the listener was created

  const Options options_;
  const MixMode mode_;
  std::mutex making_;  // held by the sampler at work, and while the caller changes what it works on
  Ears current_;
  Ears outgoing_;      // during a fade; empty otherwise
  Ears incoming_;      // once that fade has ended
  std::mutex moving_;  // held by move() alone, which does not wait for a keyframe
  LatestValue<Listener> moved_;

  // Used by the audio thread.
  AuralizerCrossfade mixed_;
  const std::unique_ptr<Resampler> resampler_;  // null at the mixer's rate
  std::vector<float> part_;                     // of a block, interleaved
};

}  // namespace clamor
