// voice_shedding.h: which voices of a keyframe sound when there is no time for all.
//
// Voices have ranks, and those above a limit are shed: it is the highest rank with at most as many
// voices up to it as are allowed, or 0.
//
// Threads: the audio thread's.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "runtime/realtime/realtime.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

class VoiceShedding {
 public:
  // Takes effect with the next load() or limit_to().
  void allow(std::size_t voices) noexcept REALTIME { allowed_ = voices; }

  // Counts the voices of a new keyframe and sets the limit for them.
  void load(std::span<const Voice> voices) noexcept REALTIME {
    up_to_rank_.fill(0);
    for (const Voice& voice : voices) ++up_to_rank_[voice.rank];
    for (std::size_t r = 1; r < up_to_rank_.size(); ++r) up_to_rank_[r] += up_to_rank_[r - 1];
    loaded_ = voices.size();
    limit_to(wanted_limit());
  }

  // The limit for the voices that are allowed now.
  std::uint8_t wanted_limit() const noexcept REALTIME {
    std::size_t rank = kHighestRank;
    while (rank > 0 && up_to_rank_[rank] > allowed_) --rank;
    return static_cast<std::uint8_t>(rank);
  }

  void limit_to(std::uint8_t rank) noexcept REALTIME { limit_ = rank; }
  std::uint8_t limit() const noexcept REALTIME { return limit_; }
  bool sheds(std::uint8_t rank) const noexcept REALTIME { return rank > limit_; }

  std::size_t loaded() const noexcept REALTIME { return loaded_; }
  std::size_t shed() const noexcept REALTIME { return loaded_ - up_to_rank_[limit_]; }

 private:
  std::size_t allowed_ = std::numeric_limits<std::size_t>::max();
  std::size_t loaded_ = 0;
  std::uint8_t limit_ = kHighestRank;
  std::array<std::uint32_t, kHighestRank + 1> up_to_rank_{};  // voices of the keyframe
};

}  // namespace clamor
