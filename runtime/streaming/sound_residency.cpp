#include "runtime/streaming/sound_residency.h"

#include <algorithm>

#include "common/sample_rate.h"

namespace clamor {

namespace {

// What the mixer may read before the clock less a delay: as it begins, with the bank's tail. And
// the frames after it in which a piece counts as read now, or soon.
constexpr std::int64_t kBehind_frames = 12 * 1024;
constexpr std::int64_t kNow_frames = kSampleRate_hz;
constexpr std::int64_t kSoon_frames = 4 * std::int64_t{kSampleRate_hz};
// What emitters played may still be on its way.
constexpr std::int64_t kUnderWay_frames = 2 * std::int64_t{kSampleRate_hz};

}  // namespace

SoundResidency::SoundResidency(std::span<PreparedSignal> signals, const SoundBudget& budget,
                               const std::atomic<std::uint64_t>& passes)
    : signals_(signals), budget_(budget), passes_(passes) {
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

void SoundResidency::look(std::span<const Reading> read, std::span<const Reading> emitted,
                          std::int64_t clock_frames, std::int64_t ahead_frames) {
  ++round_;
  needed_.clear();
  const auto add = [&](const Reading& reading, std::int64_t behind, std::int64_t ahead, Need what) {
    const std::int64_t last = clock_frames - reading.step * kDelayStep_frames;
    need(reading.signal, last - kDelayStep_frames - behind, last + ahead_frames + ahead, what,
         reading.power);
  };
  for (const Reading& reading : read) {
    add(reading, kBehind_frames, kNow_frames, Need::kNow);
    add(reading, 0, kSoon_frames, Need::kSoon);
  }
  for (const Reading& reading : emitted)
    add(reading, kUnderWay_frames, kSoon_frames, Need::kPerhaps);
}

bool SoundResidency::lacks_needed_now() const {
  return std::any_of(needed_.begin(), needed_.end(), [this](std::uint32_t i) {
    const Piece& piece = pieces_[i];
    const bool comes = piece.place == Place::kAbsent || piece.place == Place::kLoading ||
                       piece.place == Place::kLeaving;
    return piece.need == Need::kNow && comes && !piece.crowded;
  });
}

SoundResidency::Piece* SoundResidency::choose() {
  missing_.clear();
  for (const std::uint32_t i : needed_) {
    if (pieces_[i].place == Place::kLeaving) stay(pieces_[i]);  // its memory is as it was
    if (pieces_[i].place == Place::kAbsent) missing_.push_back(i);
  }
  if (missing_.empty() && all_fit_)  // no harm in having the short ones
    for (std::uint32_t i = 0; i < pieces_.size() && missing_.empty(); ++i)
      if (pieces_[i].place == Place::kAbsent && signals_[pieces_[i].signal].pieces() == 1)
        missing_.push_back(i);
  std::sort(missing_.begin(), missing_.end(), [this](std::uint32_t a, std::uint32_t b) {
    const Piece &one = pieces_[a], &other = pieces_[b];
    if (need_of(one) != need_of(other)) return need_of(one) > need_of(other);
    return one.power != other.power ? one.power > other.power : a < b;
  });
  for (const std::uint32_t i : missing_) {
    Piece& piece = pieces_[i];
    if (make_room(piece)) {
      piece.crowded = false;
      piece.place = Place::kLoading;
      statistics_.bytes += piece.bytes;
      statistics_.max_bytes = std::max(statistics_.max_bytes, statistics_.bytes);
      return &piece;
    }
    if (piece.need != Need::kNow || !leaving_.empty()) continue;
    statistics_.crowded += !piece.crowded;
    piece.crowded = true;
  }
  return nullptr;
}

// Makes room for a piece among those that are needed less, the least recently needed first; false
// if there is none yet.
bool SoundResidency::make_room(const Piece& wanted) {
  const auto fits = [&](std::uint64_t bytes) { return bytes + wanted.bytes <= budget_.bytes; };
  if (fits(statistics_.bytes)) return true;
  std::uint64_t left = statistics_.bytes;
  for (const std::uint32_t i : leaving_) left -= pieces_[i].bytes;
  idle_.clear();
  for (std::uint32_t i = 0; i < pieces_.size() && !fits(left); ++i)
    if (pieces_[i].place == Place::kHere && need_of(pieces_[i]) < wanted.need) idle_.push_back(i);
  std::sort(idle_.begin(), idle_.end(), [this](std::uint32_t a, std::uint32_t b) {
    const Piece &one = pieces_[a], &other = pieces_[b];
    if (need_of(one) != need_of(other)) return need_of(one) < need_of(other);
    return one.last_needed != other.last_needed ? one.last_needed < other.last_needed : a < b;
  });
  std::size_t go = 0;
  for (; go < idle_.size() && !fits(left); ++go) left -= pieces_[idle_[go]].bytes;
  if (fits(left))
    for (std::size_t i = 0; i < go; ++i) leave(idle_[i]);
  return !budget_.strict && wanted.need == Need::kNow;
}

void SoundResidency::stay(Piece& piece) {
  piece.place = Place::kHere;
  signals_[piece.signal].set_resident(piece.piece, true);
}

// Nobody begins to read it any more. In this order: see sound_loader.h.
void SoundResidency::leave(std::uint32_t index) {
  Piece& piece = pieces_[index];
  piece.place = Place::kLeaving;
  signals_[piece.signal].set_resident(piece.piece, false);
  piece.left_at = passes_.load(std::memory_order_seq_cst);
  leaving_.push_back(index);
}

void SoundResidency::give_back() {
  const std::uint64_t passes = passes_.load(std::memory_order_seq_cst);
  std::erase_if(leaving_, [&](std::uint32_t i) {
    Piece& piece = pieces_[i];
    if (piece.place != Place::kLeaving) return true;
    if (piece.left_at == passes) return false;
    signals_[piece.signal].decommit(piece.piece);
    piece.place = Place::kAbsent;
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
  stay(piece);
}

void SoundResidency::failed(Piece& piece, const std::string& why) {
  piece.place = Place::kFailed;
  statistics_.bytes -= piece.bytes;
  if (statistics_.failed++ == 0) statistics_.failure = why;
}

bool SoundResidency::all_settled() const {
  return all_fit_ && std::all_of(pieces_.begin(), pieces_.end(), [](const Piece& piece) {
           return piece.place == Place::kHere || piece.place == Place::kFailed;
         });
}

}  // namespace clamor
