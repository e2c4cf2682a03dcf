// narrowband_voices.h: the voices that are heard through all the narrow bands of a head.
//
// A voice's colour in 36 bands and 14 quadratures an ear costs six times what its eight octaves do.
// So at each keyframe the loudest voices get theirs (MixMode::fine_voices, 128), and of the others,
// each of which has less than a 128th of the power of all, the head colours the octaves only: their
// energy stays right, and so do the times between the ears, two of them. One source alone, or a
// hundred, have every narrow band; in a crowd nobody can tell one voice's, and the sum of all has
// the power that it should have in each, within 1 dB even if all come from one side
// (diffuse_hrtf_eq.h). A voice that is or was fine lately stays so at up to 3 dB less than others
// need; one that changes slides from one set of gains to the other within a keyframe.
//
// Threads: the audio thread's, but for the constructor. Memory: 1.3 kB for each of twice
// fine_voices. Cost: one comparison a voice and keyframe, log n for those that enter.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "runtime/realtime/realtime.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

class NarrowbandVoices {
 public:
  // `slots` of all voices, of which `most` may be fine.
  NarrowbandVoices(std::size_t slots, std::size_t most);

  // At a keyframe: begin(), offer() every voice with its power, end(); then, at it and at each
  // further segment on the way to it, begin_segment() and set() every one.
  void begin() noexcept REALTIME;
  void offer(std::uint32_t slot, float power) noexcept REALTIME;
  void end() noexcept REALTIME;
  void begin_segment() noexcept REALTIME { heard_.clear(); }
  bool chosen(std::uint32_t slot) const noexcept REALTIME { return chosen_[slot]; }

  // Slides to `targets` (kHrtfLanes), or to silence if they are null, in so many frames; from
  // silence if the voice `starts`. True if anything is heard of it here.
  bool set(std::uint32_t slot, const float* targets, bool starts, int frames) noexcept REALTIME;

  // Calls change(targets, gains) for a voice that is heard here: kHrtfLanes, and twice as many as
  // mix_kernel.h has them.
  template <class Change>
  void change(std::uint32_t slot, const Change& change) noexcept REALTIME {
    const std::uint32_t place = place_of_[slot];
    if (place == kNone) return;
    change(&targets_[place * kHrtfLanes], &gains_[2 * place * kHrtfLanes]);
  }

  // Those that is_over(slot) are not mixed any more in this segment.
  template <class IsOver>
  void drop(const IsOver& is_over) noexcept REALTIME {
    std::erase_if(heard_, [&](std::uint32_t place) { return is_over(fine_[place].slot); });
  }

  // Gains stay what they were meant to become.
  void hold() noexcept REALTIME;

  // How many are mixed.
  std::size_t heard() const noexcept REALTIME { return heard_.size(); }

  // Mixes them from where all slots are. When all others have been mixed, who may be these as well,
  // put_back() says where they go on.
  void mix(const MixMode& mode, const MixContinuation& slots, int first_frame, int frames,
           float* high, float* low) noexcept REALTIME;
  void put_back(const MixContinuation& slots) const noexcept REALTIME;

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Fine {
    std::uint32_t slot = kNone;
    bool stays = false;  // when the segment ends
  };

  const std::size_t most_;
  std::vector<std::uint32_t> place_of_;                   // by slot, in fine_; or kNone
  std::vector<bool> chosen_;                              // by slot
  std::vector<std::pair<float, std::uint32_t>> loudest_;  // a heap, the quietest first
  std::vector<Fine> fine_;
  std::vector<std::uint32_t> free_;
  std::vector<float> targets_, gains_;  // [place][kHrtfLanes], [place][2][kHrtfLanes]
  std::vector<VoicePath> paths_;        // [place][kEars]
  std::vector<LayerOffset> gaps_;       // [place], as are the next
  std::vector<std::int64_t> wraps_;
  std::vector<std::uint32_t> heard_;  // places
};

}  // namespace clamor
