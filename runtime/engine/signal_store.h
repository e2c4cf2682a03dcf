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
#include "runtime/engine/memory_budget.h"
#include "runtime/streaming/sound_loader.h"

namespace clamor {

// Memory of all sounds of a bake when decoded, for any output.
std::uint64_t decoded_sounds_bytes(const BakeFile& file);

class SignalStore {
 public:
  // With a file, streams its signals, then those of the input; without one, prepares those of the
  // input. `file` and `input` must outlive this.
  SignalStore(const BakeFile* file, const AuralizerInput& input, const MixMode& mode,
              const AuralizerOptions& options);

  std::span<const PreparedSignal> signals() const { return signals_; }

  // Null if all signals are in memory.
  SoundLoader* loader() const { return loader_.get(); }
  // The shares of signals and pages, if signals are streamed.
  const MemoryBudget& budget() const { return budget_; }

  // Loads what a keyframe plays and what its sample lacked; waits for it if the options say so.
  // `also` are further reads.
  void play(const Keyframe& keyframe, std::span<const WantedSound> wanted,
            std::span<const Voice> also = {});

  // Before the first keyframe: waits for what its sample lacked, up to a time since creation.
  // Returns whether there was anything to wait for.
  bool load_first(std::span<const WantedSound> wanted, double longest_s);
  bool load_first(std::span<const WantedSound> wanted) {
    return load_first(wanted, first_sounds_s_);
  }

 private:
  const bool wait_for_all_;
  const double created_s_, first_sounds_s_;
  MemoryBudget budget_;
  const std::unique_ptr<SoundLoader> loader_;
  const std::vector<PreparedSignal> prepared_;  // without a loader
  const std::span<const PreparedSignal> signals_;
};

}  // namespace clamor
