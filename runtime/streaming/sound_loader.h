// sound_loader.h: keeps the stretches of sound that voices play in memory, and decodes others
// ahead.
//
// Nothing is decoded at the opening. Each keyframe says which signals its voices read and how late;
// with the mixer's clock that tells which pieces (prepared_signal.h) are read now, and which soon.
// Loader threads decode them in this order: what is read within a second, then within four, the
// loudest first, then what emitters play though nobody hears it. Beyond the budget, pieces that
// are needed less are dropped, the least recently needed first; what is read now never is. A voice
// whose sound is not here is held back by the mixer and counted; it never reads what is not here.
//
// A sampler that stands still stops nothing: what the last keyframes' voices read goes on with the
// clock.
//
// How the audio thread never meets a page that is gone: it looks at the flag of each piece that its
// next segment reads, and reads no others; between segments it calls pass(). A piece is dropped by
// clearing its flag, then waiting for a pass() that began later: whoever saw the flag set is done.
// Both sides do that in sequentially consistent order. Pieces are touched, locked where allowed and
// filled before their flag is set.
//
// Threads: play() and wait() are the sampler's, pass() the audio thread's, statistics() any's.
// Memory: the budget, and some 8 MB of work for each loader thread while it decodes. Decoding and
// preparing goes 200 to 340 times as fast as real time: tests/benchmarks/sound_benchmark.cpp.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "formats/level/emitter.h"
#include "runtime/realtime/realtime.h"
#include "runtime/streaming/prepared_signal.h"
#include "runtime/streaming/signal_block_cache.h"
#include "runtime/streaming/sound_residency.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

class SoundLoader {
 public:
  // `keyframes` is how many may be on their way to the mixer. `emitters` are known beforehand.
  SoundLoader(const std::vector<SignalDescription>& shapes, std::span<const Emitter> emitters,
              const MixMode& mode, SignalBlockCache::Decode decode, const SoundBudget& budget,
              std::size_t keyframes, int threads = 1);
  ~SoundLoader();
  SoundLoader(const SoundLoader&) = delete;
  SoundLoader& operator=(const SoundLoader&) = delete;

  // Valid as long as the loader is.
  std::span<const PreparedSignal> signals() const { return signals_; }

  std::uint64_t budget_bytes() const { return budget_bytes_; }

  // How much all of it would take.
  static std::uint64_t bytes_of(const std::vector<SignalDescription>& shapes, const MixMode& mode);

  // The sampler: a keyframe with these voices follows.
  void play(std::span<const Voice> voices);
  // Until all that is read now is here, or cannot be: true; or so long. A strict budget may need a
  // pass() before it can go on.
  bool wait(double longest_s);

  // The audio thread: between segments, nothing being read; the mixer is at this clock.
  void pass(std::int64_t clock_frames) noexcept REALTIME {
    clock_.store(clock_frames, std::memory_order_relaxed);
    passes_.fetch_add(1, std::memory_order_seq_cst);
  }

  SoundStatistics statistics() const;

  // For tests: all memory there may ever be, here or not.
  std::span<const std::byte> memory() const { return {memory_->data(), memory_->bytes()}; }

 private:
  struct Shared;
  struct Heard {
    float power = 0;
    std::uint64_t keyframe = 0;
  };
  void run();

  std::vector<PreparedSignal> signals_;
  std::vector<std::uint32_t>
      continuation_;  // by signal: the loop of an onset, else the signal itself
  std::shared_ptr<SoundMemory> memory_;
  const std::uint64_t keyframes_, budget_bytes_;

  // The sampler's: what voices read, by signal and step of delay.
  std::unordered_map<std::uint64_t, Heard> heard_;
  std::uint64_t played_ = 0;

  std::atomic<std::int64_t> clock_{0};
  std::atomic<std::uint64_t> passes_{0};
  std::unique_ptr<Shared> shared_;
};

}  // namespace clamor
