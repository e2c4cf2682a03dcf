// signal_store.h: the signals that an auralizer plays, all in memory or streamed from a file.
//
// Threads: constructed by one thread; play() is the sampler's.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/streaming/sound_loader.h"

namespace clamor {

class SignalStore {
 public:
  // With a file, streams its signals, then those of the input; without one, prepares those of the
  // input. `file` and `input` must outlive this.
  SignalStore(const BakeFile* file, const AuralizerInput& input, const MixMode& mode,
              const AuralizerOptions& options);

  std::span<const PreparedSignal> signals() const { return signals_; }

  // Null if all signals are in memory.
  SoundLoader* loader() const { return loader_.get(); }
  std::uint64_t budget_bytes() const;  // of the loader, or 0

  // Loads what a keyframe plays. The first keyframe waits for it up to a time limit, and every
  // keyframe waits without one if the options say so.
  void play(const Keyframe& keyframe);

 private:
  const bool wait_for_all_;
  const double first_deadline_s_;
  const std::unique_ptr<SoundLoader> loader_;
  const std::vector<PreparedSignal> prepared_;  // without a loader
  const std::span<const PreparedSignal> signals_;
};

}  // namespace clamor
