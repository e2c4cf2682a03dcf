// sound_residency.h: decides which pieces of the signals are loaded and which are evicted.
//
// Each round plans what memory shall hold: the pieces that are needed most, and of these the
// loudest, as far as they fit. A resident piece counts twice its power, so that two pieces of about
// the same loudness do not replace each other all the time. A resident piece that is needed but not
// in the plan is leaving: no further source is chosen for it, and it is evicted once its voices
// have faded out, after half a second at the latest.
//
// Not thread-safe: SoundLoader's threads share it under their mutex.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/sample_rate.h"
#include "runtime/streaming/prepared_signal.h"
#include "runtime/streaming/sound_statistics.h"

namespace clamor {

struct SoundBudget {
  std::uint64_t bytes = 32'000'000;
  bool strict = true;  // otherwise pieces that are read now may exceed the budget
};

// A read position: a signal at a delay of `step` to `step` + 1 times kDelayStep_frames.
inline constexpr std::int64_t kDelayStep_frames = 8192;
struct ReadPosition {
  std::uint32_t signal = 0;
  std::int32_t step = 0;
  float power = 0;
};

// Pieces that are read within this time are needed now.
inline constexpr std::int64_t kNow_frames = kSampleRate_hz;
// The mixer may read this far before (clock - delay), when it starts with the filter bank's tail.
inline constexpr std::int64_t kBehind_frames = 12 * 1024;

class SoundResidency {
 public:
  enum class State : std::uint8_t { kAbsent, kLoading, kResident, kEvicting, kFailed };
  enum class Need : std::uint8_t { kNone, kEmitted, kSoon, kNow };

  // The positions that are read, or would be read.
  struct Needs {
    std::vector<ReadPosition> played;   // by voices
    std::vector<ReadPosition> wanted;   // by sources that had voices if their sounds were resident
    std::vector<ReadPosition> emitted;  // by emitters, with or without a voice
  };

  struct Piece {
    std::uint32_t signal = 0, piece = 0;  // index within the signal
    std::uint64_t bytes = 0;
    State state = State::kAbsent;
    bool locked = false;
    bool over_budget = false;       // did not fit when it was needed now
    bool waits_for_voices = false;  // those of a quieter piece fade out, to make room
    std::uint64_t evicted_at = 0;   // value of `quiescent_points`
    std::uint64_t last_needed = 0;  // round, to which the following belong
    Need need = Need::kNone;
    bool is_played = false;   // a voice reads it now
    bool is_planned = false;  // memory shall hold it
    float power = 0;
    std::int64_t leaves_at_frames = 0;  // clock at which it may be evicted though it is played
  };

  // `quiescent_points` counts the audio thread's calls of mark_quiescent() (sound_loader.h).
  SoundResidency(std::span<PreparedSignal> signals, const SoundBudget& budget,
                 const std::atomic<std::uint64_t>& quiescent_points);

  // Begins a round: computes which pieces are needed at this clock by a segment that begins within
  // `ahead_frames`, and plans what memory shall hold.
  void update_needs(const Needs& needs, std::int64_t clock_frames, std::int64_t ahead_frames);

  // Returns whether pieces that are needed now, and for which there is room, were lacking at the
  // last update_needs().
  bool lacks_needed_now() const;
  // The next piece to load, now marked as loading, or null. May evict others.
  Piece* next_to_load();

  // The result of loading a piece.
  void loaded(Piece& piece, bool locked);
  void failed(Piece& piece, const std::string& why);

  // Frees the memory of evicted pieces that no thread can be reading any more.
  void free_evicted();

  bool all_settled() const;  // every piece is resident or has failed
  bool all_resident() const { return statistics_.failed == 0 && all_settled(); }
  const SoundStatistics& statistics() const { return statistics_; }

 private:
  void need(const ReadPosition& reading, std::int64_t from, std::int64_t to, Need need,
            bool is_played);
  void plan();
  bool may_be_evicted(const Piece& piece) const;
  bool make_room(const Piece& wanted);
  void mark_resident(Piece& piece);
  void tell_residency(const Piece& piece);
  void evict(std::uint32_t index);

  const std::span<PreparedSignal> signals_;
  const SoundBudget budget_;
  const std::atomic<std::uint64_t>& quiescent_points_;
  std::vector<Piece> pieces_;
  std::vector<std::size_t> first_piece_;  // by signal
  bool all_fit_ = false;

  std::uint64_t round_ = 0;
  std::int64_t clock_frames_ = 0;      // of this round
  std::vector<std::uint32_t> needed_;  // in this round, the most needed and loudest first
  std::vector<std::uint32_t> evicting_, evictable_;
  SoundStatistics statistics_;
};

}  // namespace clamor
