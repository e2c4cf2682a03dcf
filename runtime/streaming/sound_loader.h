// sound_loader.h: streams sounds: keeps the pieces that voices read in memory and decodes others
// ahead.
//
// Opening decodes nothing. Each keyframe tells which signals its voices read and at which delays,
// and which sources would have voices if their sounds were in memory; with the mixer's clock this
// gives the pieces (prepared_signal.h) that are needed now and those that are needed soon. Loader
// threads decode in this order: pieces needed within a second, then those that voices read within
// four seconds, the loudest first, then those that emitters play although no voice reads them.
// Memory holds as much of this as the budget allows (sound_residency.h).
//
// The sampler chooses a source only if is_ready(): what it reads within the next second is in
// memory and stays there. A source whose sound is not there yet therefore takes no voice from
// another, and a voice fades out, as any that is no longer chosen, before its sound ends. What is
// mixed is an unbiased sample of the sources whose sounds are there; the others are silent. If a
// voice lacks a piece nevertheless, the mixer mutes and counts it.
//
// If the sampler stalls, loading continues: the voices of the last keyframes read on with the
// clock.
//
// Eviction is safe for the audio thread, which takes no locks. It checks the flag of each piece
// that its next segment reads, reads no others, and calls mark_quiescent() between segments. The
// loader clears the flag of an evicted piece and frees it only after a later mark_quiescent(): a
// reader that saw the flag set has then finished. Before the first mark_quiescent() there are no
// readers, and it is freed at once. Both sides use sequentially consistent order.
// Pieces are faulted in, locked where the system allows it, and filled before their flag is set.
//
// Threads: play(), is_ready() and wait() run on the sampler's thread, mark_quiescent() on the audio
// thread, statistics() on any. Memory: the budget, and some 8 MB of scratch memory per loader
// thread while it decodes. Decoding and preparing run 200 to 340 times as fast as real time
// (tests/benchmarks/sound_benchmark.cpp).
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
#include "runtime/realtime/thread_hooks.h"
#include "runtime/streaming/prepared_signal.h"
#include "runtime/streaming/signal_block_cache.h"
#include "runtime/streaming/sound_residency.h"
#include "runtime/streaming/wanted_sound.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

class SoundLoader {
 public:
  // `keyframes` is how many may be queued for the mixer. `emitters` are loaded ahead even if no
  // voice plays them yet.
  SoundLoader(const std::vector<SignalDescription>& shapes, std::span<const Emitter> emitters,
              const MixMode& mode, SignalBlockCache::Decode decode, const SoundBudget& budget,
              std::size_t keyframes, int threads = 1, const ThreadHooks& hooks = {});
  ~SoundLoader();
  SoundLoader(const SoundLoader&) = delete;
  SoundLoader& operator=(const SoundLoader&) = delete;

  // Valid as long as the loader.
  std::span<const PreparedSignal> signals() const { return signals_; }

  std::uint64_t budget_bytes() const { return budget_bytes_; }

  // Memory for all signals if every piece were resident, and for decoding them.
  static std::uint64_t bytes_of(const std::vector<SignalDescription>& shapes, const MixMode& mode);

  // Sampler: announces a keyframe with these voices and those that stand for other reads, and what
  // its sample lacked.
  void play(std::span<const Voice> voices, std::span<const WantedSound> wanted = {},
            std::span<const Voice> also = {});

  // Returns whether a voice that begins at this time of its signal has what it reads within the
  // next second. Signals that the loader does not know are always ready.
  bool is_ready(std::uint32_t signal, double signal_s) const;
  // Returns whether all signals are ready at all times, from now on.
  bool all_ready() const;
  // Waits until all pieces that are read now are resident or have failed (true), or until the time
  // limit. With a strict budget, progress may need a mark_quiescent() once there was one. Without
  // threads it loads them itself, the loudest first, and one at least.
  bool wait(double longest_s);

  // For a loader without threads: loads the most urgent piece now; false if there is none. On any
  // one thread.
  bool load_next();

  // Audio thread, between segments: it reads no piece at the moment, and the mixer is at this
  // clock.
  void mark_quiescent(std::int64_t clock_frames) noexcept REALTIME {
    clock_.store(clock_frames, std::memory_order_relaxed);
    quiescent_points_.fetch_add(1, std::memory_order_seq_cst);
  }

  SoundStatistics statistics() const;

  // For tests: all memory that pieces may ever use, resident or not.
  std::span<const std::byte> memory() const { return {memory_->data(), memory_->bytes()}; }

 private:
  struct Shared;
  struct RecentRead {
    float power = 0;
    std::uint64_t keyframe = 0;
  };
  void run();
  void update_needs();                                 // under the lock
  bool load_next(std::unique_lock<std::mutex>& lock);  // which is released meanwhile
  std::vector<ReadPosition> read_by(std::span<const Voice> voices, std::span<const Voice> also);
  std::vector<ReadPosition> read_by(std::span<const WantedSound> wanted) const;

  std::vector<PreparedSignal> signals_;
  // By signal: the loop that follows an onset, and the onset that a loop starts with; else the
  // signal itself.
  std::vector<std::uint32_t> continuation_, onset_;
  std::shared_ptr<ReservedMemory> memory_;
  const std::uint64_t keyframes_, budget_bytes_;
  std::uint64_t all_bytes_ = 0;

  // Sampler thread: what voices read, by signal and delay step.
  std::unordered_map<std::uint64_t, RecentRead> recent_reads_;
  std::uint64_t played_ = 0;
  std::atomic<std::uint64_t> handed_over_{0};

  std::atomic<std::int64_t> clock_{0};
  std::atomic<std::uint64_t> quiescent_points_{0};
  std::unique_ptr<Shared> shared_;
};

}  // namespace clamor
