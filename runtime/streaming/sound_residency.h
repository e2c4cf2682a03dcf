// sound_residency.h: which pieces of the signals are in memory, which should be, and which may go.
//
// Not thread-safe: what SoundLoader's threads share, under its mutex.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "runtime/streaming/prepared_signal.h"

namespace clamor {

struct SoundStatistics {
  std::uint64_t loaded = 0, dropped = 0, failed = 0;  // pieces
  std::uint64_t resident = 0, bytes = 0;              // pieces, and their memory
  std::uint64_t max_bytes = 0;                        // that there ever were
  std::uint64_t locked_bytes = 0;
  bool lock_refused = false;  // the system would not lock all of it
  std::uint64_t crowded = 0;  // pieces that were needed now and found no room in the budget
  std::uint64_t late = 0;     // voices held back for a keyframe: their sound was not here
  std::string failure;        // the first, as a sentence
};

struct SoundBudget {
  std::uint64_t bytes = 32'000'000;
  bool strict = true;  // or may what is read now take more
};

// That voices read a signal, or will, behind the clock by `step` times kDelayStep_frames and up
// to one more.
inline constexpr std::int64_t kDelayStep_frames = 8192;
struct Reading {
  std::uint32_t signal = 0;
  std::int32_t step = 0;
  float power = 0;
};

class SoundResidency {
 public:
  enum class Place : std::uint8_t { kAbsent, kLoading, kHere, kLeaving, kFailed };
  enum class Need : std::uint8_t { kNone, kPerhaps, kSoon, kNow };

  struct Piece {
    std::uint32_t signal = 0, piece = 0;  // piece of the signal
    std::uint64_t bytes = 0;
    Place place = Place::kAbsent;
    bool locked = false;
    bool crowded = false;           // found no room when it was needed now
    std::uint64_t left_at = 0;      // passes
    std::uint64_t last_needed = 0;  // round
    Need need = Need::kNone;        // in that round
    float power = 0;
  };

  // `passes` counts the audio thread's (sound_loader.h).
  SoundResidency(std::span<PreparedSignal> signals, const SoundBudget& budget,
                 const std::atomic<std::uint64_t>& passes);

  // Begins a round: tells what is needed with the clock where it is, a segment beginning in the
  // next `ahead_frames`. `emitted` is what emitters play, heard or not.
  void look(std::span<const Reading> read, std::span<const Reading> emitted,
            std::int64_t clock_frames, std::int64_t ahead_frames);

  // Of the last look.
  bool lacks_needed_now() const;
  // The piece to load first, or null: it counts as loading now. Others may have to leave for it.
  Piece* choose();

  // What became of it.
  void loaded(Piece& piece, bool locked);
  void failed(Piece& piece, const std::string& why);

  // Gives back the memory of pieces that left and that nobody can be reading any more.
  void give_back();

  bool all_settled() const;  // here for good, or failed
  const SoundStatistics& statistics() const { return statistics_; }

 private:
  void need(std::uint32_t signal, std::int64_t from, std::int64_t to, Need need, float power);
  Need need_of(const Piece& piece) const {
    return piece.last_needed == round_ ? piece.need : Need::kNone;
  }
  bool make_room(const Piece& wanted);
  void stay(Piece& piece);
  void leave(std::uint32_t index);

  const std::span<PreparedSignal> signals_;
  const SoundBudget budget_;
  const std::atomic<std::uint64_t>& passes_;
  std::vector<Piece> pieces_;
  std::vector<std::size_t> first_piece_;  // by signal
  bool all_fit_ = false;

  std::uint64_t round_ = 0;
  std::vector<std::uint32_t> needed_;  // in this round
  std::vector<std::uint32_t> leaving_, missing_, idle_;
  SoundStatistics statistics_;
};

}  // namespace clamor
