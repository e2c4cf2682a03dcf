// sound_residency.h: decides which pieces of the signals are loaded and which are evicted.
//
// Not thread-safe: SoundLoader's threads share it under their mutex.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "runtime/streaming/prepared_signal.h"
#include "runtime/streaming/sound_statistics.h"

namespace clamor {

struct SoundBudget {
  std::uint64_t bytes = 32'000'000;
  bool strict = true;  // otherwise pieces that are read now may exceed the budget
};

// A voice's read position: a signal at a delay of `step` to `step` + 1 times kDelayStep_frames.
inline constexpr std::int64_t kDelayStep_frames = 8192;
struct ReadPosition {
  std::uint32_t signal = 0;
  std::int32_t step = 0;
  float power = 0;
};

class SoundResidency {
 public:
  enum class State : std::uint8_t { kAbsent, kLoading, kResident, kEvicting, kFailed };
  enum class Need : std::uint8_t { kNone, kEmitted, kSoon, kNow };

  struct Piece {
    std::uint32_t signal = 0, piece = 0;  // index within the signal
    std::uint64_t bytes = 0;
    State state = State::kAbsent;
    bool locked = false;
    bool over_budget = false;       // did not fit when it was needed now
    std::uint64_t evicted_at = 0;   // value of `quiescent_points`
    std::uint64_t last_needed = 0;  // round
    Need need = Need::kNone;        // in that round
    float power = 0;
  };

  // `quiescent_points` counts the audio thread's calls of mark_quiescent() (sound_loader.h).
  SoundResidency(std::span<PreparedSignal> signals, const SoundBudget& budget,
                 const std::atomic<std::uint64_t>& quiescent_points);

  // Begins a round: computes which pieces are needed at this clock by a segment that begins within
  // `ahead_frames`. `emitted` lists what emitters play, with or without a voice.
  void update_needs(std::span<const ReadPosition> read, std::span<const ReadPosition> emitted,
                    std::int64_t clock_frames, std::int64_t ahead_frames);

  // Returns whether pieces were lacking at the last update_needs().
  bool lacks_needed_now() const;
  // The next piece to load, now marked as loading, or null. May evict others.
  Piece* next_to_load();

  // The result of loading a piece.
  void loaded(Piece& piece, bool locked);
  void failed(Piece& piece, const std::string& why);

  // Frees the memory of evicted pieces that no thread can be reading any more.
  void free_evicted();

  bool all_settled() const;  // every piece is resident or has failed
  const SoundStatistics& statistics() const { return statistics_; }

 private:
  void need(std::uint32_t signal, std::int64_t from, std::int64_t to, Need need, float power);
  Need need_of(const Piece& piece) const {
    return piece.last_needed == round_ ? piece.need : Need::kNone;
  }
  bool make_room(const Piece& wanted);
  void mark_resident(Piece& piece);
  void evict(std::uint32_t index);

  const std::span<PreparedSignal> signals_;
  const SoundBudget budget_;
  const std::atomic<std::uint64_t>& quiescent_points_;
  std::vector<Piece> pieces_;
  std::vector<std::size_t> first_piece_;  // by signal
  bool all_fit_ = false;

  std::uint64_t round_ = 0;
  std::vector<std::uint32_t> needed_;  // in this round
  std::vector<std::uint32_t> evicting_, missing_, idle_;
  SoundStatistics statistics_;
};

}  // namespace clamor
