#include "runtime/streaming/sound_residency.h"

#include <algorithm>
#include <utility>

namespace clamor {

namespace {

// Pieces that a voice reads within this time are needed soon.
constexpr std::int64_t kSoon_frames = 4 * kNow_frames;
// Sound that emitters have played may still be travelling for this long.
constexpr std::int64_t kTravel_frames = 2 * std::int64_t{kSampleRate_hz};
// Voices have this long to fade out before the piece that they read is evicted.
constexpr std::int64_t kFadeOut_frames = kNow_frames / 2;
constexpr float kResidentBonus = 2;

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

void SoundResidency::need(const ReadPosition& reading, std::int64_t from, std::int64_t to,
                          Need need, bool is_played) {
  signals_[reading.signal].for_pieces(from, to, [&](std::size_t p) {
    const std::size_t index = first_piece_[reading.signal] + p;
    Piece& piece = pieces_[index];
    if (piece.last_needed != round_) {
      piece.last_needed = round_;
      piece.need = Need::kNone;
      piece.is_played = false;
      piece.power = 0;
      needed_.push_back(static_cast<std::uint32_t>(index));
    }
    piece.need = std::max(piece.need, need);
    piece.is_played = piece.is_played || is_played;
    piece.power += reading.power;
    return true;
  });
}

void SoundResidency::update_needs(const Needs& needs, std::int64_t clock_frames,
                                  std::int64_t ahead_frames) {
  ++round_;
  clock_frames_ = clock_frames;
  needed_.clear();
  const auto add = [&](const ReadPosition& reading, std::int64_t behind, std::int64_t ahead,
                       Need what, bool is_played) {
    const std::int64_t last = clock_frames - reading.step * kDelayStep_frames;
    need(reading, last - kDelayStep_frames - behind, last + ahead_frames + ahead, what, is_played);
  };
  for (const ReadPosition& reading : needs.played) {
    add(reading, kBehind_frames, kNow_frames, Need::kNow, true);
    add(reading, 0, kSoon_frames, Need::kSoon, false);
  }
  for (const ReadPosition& reading : needs.wanted)
    add(reading, kBehind_frames, kNow_frames, Need::kNow, false);
  for (const ReadPosition& reading : needs.emitted)
    add(reading, kTravel_frames, kSoon_frames, Need::kEmitted, false);
  plan();
}

// Sorts what is needed, and plans as much of it as fits.
void SoundResidency::plan() {
  const auto rank = [this](std::uint32_t i) {
    const Piece& piece = pieces_[i];
    return std::pair(piece.need,
                     piece.power * (piece.state == State::kResident ? kResidentBonus : 1));
  };
  std::sort(needed_.begin(), needed_.end(), [&rank](std::uint32_t a, std::uint32_t b) {
    return rank(a) != rank(b) ? rank(a) > rank(b) : a < b;
  });
  std::uint64_t bytes = 0;
  for (const std::uint32_t i : needed_) {
    Piece& piece = pieces_[i];
    if (piece.state == State::kFailed) continue;
    const bool is_now = piece.need == Need::kNow;
    const bool was_planned = std::exchange(
        piece.is_planned, bytes + piece.bytes <= budget_.bytes || (is_now && !budget_.strict));
    if (piece.is_planned) bytes += piece.bytes;
    if (was_planned && !piece.is_planned) piece.leaves_at_frames = clock_frames_ + kFadeOut_frames;
    const bool did_fit = !std::exchange(piece.over_budget, is_now && !piece.is_planned);
    statistics_.over_budget += did_fit && piece.over_budget;
    if (piece.state == State::kResident) tell_residency(piece);
  }
}

bool SoundResidency::lacks_needed_now() const {
  return std::any_of(needed_.begin(), needed_.end(), [this](std::uint32_t i) {
    const Piece& piece = pieces_[i];
    return piece.need == Need::kNow && piece.is_planned && !piece.waits_for_voices &&
           piece.state != State::kResident && piece.state != State::kFailed;
  });
}

SoundResidency::Piece* SoundResidency::next_to_load() {
  const auto begin = [this](Piece& piece) {
    piece.state = State::kLoading;
    piece.is_planned = true;
    piece.waits_for_voices = false;
    statistics_.bytes += piece.bytes;
    statistics_.max_bytes = std::max(statistics_.max_bytes, statistics_.bytes);
    return &piece;
  };
  bool is_missing = false;
  for (const std::uint32_t i : needed_) {
    Piece& piece = pieces_[i];
    if (!piece.is_planned) continue;
    if (piece.state == State::kEvicting) mark_resident(piece);  // its memory is still intact
    if (piece.state != State::kAbsent) continue;
    is_missing = true;
    if (make_room(piece)) return begin(piece);
    piece.waits_for_voices = evicting_.empty();
  }
  if (is_missing || !all_fit_) return nullptr;
  // With room for everything, load the short signals too.
  for (Piece& piece : pieces_)
    if (piece.state == State::kAbsent && signals_[piece.signal].pieces() == 1) return begin(piece);
  return nullptr;
}

bool SoundResidency::may_be_evicted(const Piece& piece) const {
  if (piece.state != State::kResident) return false;
  if (piece.last_needed != round_) return true;
  return !piece.is_planned && (!piece.is_played || clock_frames_ >= piece.leaves_at_frames);
}

// Evicts pieces that are not planned until `wanted` fits, the least needed first, and then the
// least recently needed. False if there is no room yet.
bool SoundResidency::make_room(const Piece& wanted) {
  const auto fits = [&](std::uint64_t bytes) { return bytes + wanted.bytes <= budget_.bytes; };
  if (fits(statistics_.bytes)) return true;
  std::uint64_t left = statistics_.bytes;
  for (const std::uint32_t i : evicting_) left -= pieces_[i].bytes;
  evictable_.clear();
  for (std::uint32_t i = 0; i < pieces_.size() && !fits(left); ++i)
    if (may_be_evicted(pieces_[i])) evictable_.push_back(i);
  std::sort(evictable_.begin(), evictable_.end(), [this](std::uint32_t a, std::uint32_t b) {
    const Piece &one = pieces_[a], &other = pieces_[b];
    if (one.last_needed != other.last_needed) return one.last_needed < other.last_needed;
    if (one.need != other.need) return one.need < other.need;
    return one.power != other.power ? one.power < other.power : a < b;
  });
  std::size_t go = 0;
  for (; go < evictable_.size() && !fits(left); ++go) left -= pieces_[evictable_[go]].bytes;
  if (fits(left)) {
    for (std::size_t i = 0; i < go; ++i) evict(evictable_[i]);
    free_evicted();
    if (fits(statistics_.bytes)) return true;
  }
  return !budget_.strict && wanted.need == Need::kNow;
}

void SoundResidency::mark_resident(Piece& piece) {
  piece.state = State::kResident;
  tell_residency(piece);
}

// Tells the sampler and the mixer.
void SoundResidency::tell_residency(const Piece& piece) {
  using Residency = PreparedSignal::Residency;
  signals_[piece.signal].set_residency(piece.piece, piece.state != State::kResident
                                                        ? Residency::kAbsent
                                                    : piece.is_planned ? Residency::kStaying
                                                                       : Residency::kLeaving);
}

// Stops new reads of the piece; the order of these steps matters (sound_loader.h).
void SoundResidency::evict(std::uint32_t index) {
  Piece& piece = pieces_[index];
  piece.state = State::kEvicting;
  tell_residency(piece);
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
