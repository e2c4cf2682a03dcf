#include "runtime/streaming/sound_residency.h"

#include <algorithm>

#include "common/sample_rate.h"

namespace clamor {

namespace {

// The mixer may read this far before (clock - delay), when it starts with the filter bank's tail.
// Pieces this far after it count as read now, or soon.
constexpr std::int64_t kBehind_frames = 12 * 1024;
constexpr std::int64_t kNow_frames = kSampleRate_hz;
constexpr std::int64_t kSoon_frames = 4 * std::int64_t{kSampleRate_hz};
// Sound that emitters have played may still be travelling for this long.
constexpr std::int64_t kTravel_frames = 2 * std::int64_t{kSampleRate_hz};

}  // namespace

SoundResidency::SoundResidency(std::span<PreparedSignal> signals, const SoundBudget& budget,
                               const std::atomic<std::uint64_t>& quiescent_points)
    : signals_(signals), budget_(budget), quiescent_points_(quiescent_points) {
  std::uint64_t all = 0;
  for (std::uint32_t s = 0; s < signals.size(); ++s) {
    first_piece_.push_back(pieces_.size());
    for (std::uint32_t p = 0; p < signals[s].pieces(); ++p) {
      Piece piece;
      piece.signal = s;
      piece.piece = p;
      piece.bytes = signals[s].piece_bytes(p);
      all += piece.bytes;
      pieces_.push_back(piece);
    }
  }
  all_fit_ = all <= budget.bytes;
}

void SoundResidency::need(std::uint32_t signal, std::int64_t from, std::int64_t to, Need need,
                          float power) {
  signals_[signal].for_pieces(from, to, [&](std::size_t p) {
    const std::size_t index = first_piece_[signal] + p;
    Piece& piece = pieces_[index];
    if (piece.last_needed != round_) {
      piece.last_needed = round_;
      piece.need = Need::kNone;
      piece.power = 0;
      needed_.push_back(static_cast<std::uint32_t>(index));
    }
    piece.need = std::max(piece.need, need);
    piece.power += power;
    return true;
  });
}

void SoundResidency::update_needs(std::span<const ReadPosition> read,
                                  std::span<const ReadPosition> emitted, std::int64_t clock_frames,
                                  std::int64_t ahead_frames) {
  ++round_;
  needed_.clear();
  const auto add = [&](const ReadPosition& reading, std::int64_t behind, std::int64_t ahead,
                       Need what) {
    const std::int64_t last = clock_frames - reading.step * kDelayStep_frames;
    need(reading.signal, last - kDelayStep_frames - behind, last + ahead_frames + ahead, what,
         reading.power);
  };
  for (const ReadPosition& reading : read) {
    add(reading, kBehind_frames, kNow_frames, Need::kNow);
    add(reading, 0, kSoon_frames, Need::kSoon);
  }
  for (const ReadPosition& reading : emitted)
    add(reading, kTravel_frames, kSoon_frames, Need::kEmitted);
}

bool SoundResidency::lacks_needed_now() const {
  return std::any_of(needed_.begin(), needed_.end(), [this](std::uint32_t i) {
    const Piece& piece = pieces_[i];
    const bool comes = piece.state == State::kAbsent || piece.state == State::kLoading ||
                       piece.state == State::kEvicting;
    return piece.need == Need::kNow && comes && !piece.over_budget;
  });
}

SoundResidency::Piece* SoundResidency::next_to_load() {
  missing_.clear();
  for (const std::uint32_t i : needed_) {
    if (pieces_[i].state == State::kEvicting)
      mark_resident(pieces_[i]);  // its memory is still intact
    if (pieces_[i].state == State::kAbsent) missing_.push_back(i);
  }
  if (missing_.empty() && all_fit_)  // with room for everything, load the short signals too
    for (std::uint32_t i = 0; i < pieces_.size() && missing_.empty(); ++i)
      if (pieces_[i].state == State::kAbsent && signals_[pieces_[i].signal].pieces() == 1)
        missing_.push_back(i);
  std::sort(missing_.begin(), missing_.end(), [this](std::uint32_t a, std::uint32_t b) {
    const Piece &one = pieces_[a], &other = pieces_[b];
    if (need_of(one) != need_of(other)) return need_of(one) > need_of(other);
    return one.power != other.power ? one.power > other.power : a < b;
  });
  for (const std::uint32_t i : missing_) {
    Piece& piece = pieces_[i];
    if (make_room(piece)) {
      piece.over_budget = false;
      piece.state = State::kLoading;
      statistics_.bytes += piece.bytes;
      statistics_.max_bytes = std::max(statistics_.max_bytes, statistics_.bytes);
      return &piece;
    }
    if (piece.need != Need::kNow || !evicting_.empty()) continue;
    statistics_.over_budget += !piece.over_budget;
    piece.over_budget = true;
  }
  return nullptr;
}

// Evicts pieces that are needed less until `wanted` fits, the least recently needed first. False if
// there is no room yet.
bool SoundResidency::make_room(const Piece& wanted) {
  const auto fits = [&](std::uint64_t bytes) { return bytes + wanted.bytes <= budget_.bytes; };
  if (fits(statistics_.bytes)) return true;
  std::uint64_t left = statistics_.bytes;
  for (const std::uint32_t i : evicting_) left -= pieces_[i].bytes;
  idle_.clear();
  for (std::uint32_t i = 0; i < pieces_.size() && !fits(left); ++i)
    if (pieces_[i].state == State::kResident && need_of(pieces_[i]) < wanted.need)
      idle_.push_back(i);
  std::sort(idle_.begin(), idle_.end(), [this](std::uint32_t a, std::uint32_t b) {
    const Piece &one = pieces_[a], &other = pieces_[b];
    if (need_of(one) != need_of(other)) return need_of(one) < need_of(other);
    return one.last_needed != other.last_needed ? one.last_needed < other.last_needed : a < b;
  });
  std::size_t go = 0;
  for (; go < idle_.size() && !fits(left); ++go) left -= pieces_[idle_[go]].bytes;
  if (fits(left)) {
    for (std::size_t i = 0; i < go; ++i) evict(idle_[i]);
    free_evicted();
    if (fits(statistics_.bytes)) return true;
  }
  return !budget_.strict && wanted.need == Need::kNow;
}

void SoundResidency::mark_resident(Piece& piece) {
  piece.state = State::kResident;
  signals_[piece.signal].set_resident(piece.piece, true);
}

// Stops new reads of the piece; the order of these steps matters (sound_loader.h).
void SoundResidency::evict(std::uint32_t index) {
  Piece& piece = pieces_[index];
  piece.state = State::kEvicting;
  signals_[piece.signal].set_resident(piece.piece, false);
  piece.evicted_at = quiescent_points_.load(std::memory_order_seq_cst);
  evicting_.push_back(index);
}

void SoundResidency::free_evicted() {
  const std::uint64_t quiescent_points = quiescent_points_.load(std::memory_order_seq_cst);
  std::erase_if(evicting_, [&](std::uint32_t i) {
    Piece& piece = pieces_[i];
    if (piece.state != State::kEvicting) return true;
    // Before its first quiescent point, the audio thread has read nothing.
    if (quiescent_points > 0 && piece.evicted_at == quiescent_points) return false;
    signals_[piece.signal].decommit(piece.piece);
    piece.state = State::kAbsent;
    statistics_.bytes -= piece.bytes;
    statistics_.locked_bytes -= piece.locked ? piece.bytes : 0;
    --statistics_.resident;
    ++statistics_.dropped;
    return true;
  });
}

void SoundResidency::loaded(Piece& piece, bool locked) {
  piece.locked = locked;
  statistics_.locked_bytes += locked ? piece.bytes : 0;
  statistics_.lock_refused = statistics_.lock_refused || !locked;
  ++statistics_.resident;
  ++statistics_.loaded;
  mark_resident(piece);
}

void SoundResidency::failed(Piece& piece, const std::string& why) {
  piece.state = State::kFailed;
  statistics_.bytes -= piece.bytes;
  if (statistics_.failed++ == 0) statistics_.failure = why;
}

bool SoundResidency::all_settled() const {
  return all_fit_ && std::all_of(pieces_.begin(), pieces_.end(), [](const Piece& piece) {
           return piece.state == State::kResident || piece.state == State::kFailed;
         });
}

}  // namespace clamor
