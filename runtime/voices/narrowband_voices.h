// narrowband_voices.h: chooses the voices that are filtered in all narrow bands of an HRTF.
//
// Narrow bands, 36 with 14 quadratures an ear, cost six times as much per voice as eight octaves.
// At each keyframe the loudest voices therefore get narrow bands (MixMode::narrowband_voices, 128).
// Each of the others has less than a 128th of the total power and gets octave gains, which preserve
// its energy and both of its ITDs. Up to 128 sources are exact. In a larger crowd no single voice's
// spectrum can be audible, and the sum is corrected per narrow band to within 1 dB, even if all
// voices come from one side (diffuse_hrtf_eq.h). A narrowband voice stays one until others exceed
// it by 3 dB (hysteresis); a change crossfades within a keyframe.
//
// Threads: the audio thread, except for the constructor. Memory: 1.3 kB for each of twice
// narrowband_voices. Cost: one comparison per voice and keyframe, log n for those that enter.
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
  // `slots` is the number of all voices, `max_chosen` the number of narrowband ones.
  NarrowbandVoices(std::size_t slots, std::size_t max_chosen);

  // At a keyframe call begin(), offer() for every voice with its power, and end(). At the start of
  // each segment call begin_segment(), then set() for every voice.
  void begin() noexcept REALTIME;
  void offer(std::uint32_t slot, float power) noexcept REALTIME;
  void end() noexcept REALTIME;
  void begin_segment() noexcept REALTIME { audible_.clear(); }
  bool chosen(std::uint32_t slot) const noexcept REALTIME { return chosen_[slot]; }

  // Ramps to `targets` (kHrtfLanes), or to silence if null, in `frames` frames; from silence if the
  // voice `starts`. Returns true if the voice is audible here.
  bool set(std::uint32_t slot, const float* targets, bool starts, int frames) noexcept REALTIME;

  // Calls change(targets, gains) for a voice that is audible here, with kHrtfLanes targets and
  // twice as many gains (mix_kernel.h).
  template <class Change>
  void change(std::uint32_t slot, const Change& change) noexcept REALTIME {
    const std::uint32_t place = place_of_[slot];
    if (place == kNone) return;
    change(&targets_[place * kHrtfLanes], &gains_[2 * place * kHrtfLanes]);
  }

  // Stops mixing the voices with is_over(slot) in this segment.
  template <class IsOver>
  void drop(const IsOver& is_over) noexcept REALTIME {
    std::erase_if(audible_, [&](std::uint32_t place) { return is_over(fine_[place].slot); });
  }

  // Holds gains at their targets.
  void hold() noexcept REALTIME;

  // Number of voices mixed.
  std::size_t audible_count() const noexcept REALTIME { return audible_.size(); }

  // Mixes all narrowband voices from the state of all slots. A voice may be in octaves as well, so
  // put_back() advances the state only after those have been mixed too.
  void mix(const MixMode& mode, const MixContinuation& slots, int first_frame, int frames,
           float* high, float* low) noexcept REALTIME;
  void put_back(const MixContinuation& slots) const noexcept REALTIME;

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Fine {
    std::uint32_t slot = kNone;
    bool stays = false;  // is still mixed when the segment ends
  };

  const std::size_t max_chosen_;
  std::vector<std::uint32_t> place_of_;                   // by slot: index into fine_, or kNone
  std::vector<bool> chosen_;                              // by slot
  std::vector<std::pair<float, std::uint32_t>> loudest_;  // a heap with the quietest first
  std::vector<Fine> fine_;
  std::vector<std::uint32_t> free_;
  std::vector<float> targets_, gains_;  // [place][kHrtfLanes], [place][2][kHrtfLanes]
  std::vector<VoicePath> paths_;        // [place][kEars]
  std::vector<LayerOffset> gaps_;       // [place], as below
  std::vector<std::int64_t> wraps_;
  std::vector<std::uint32_t> audible_;  // places
};

}  // namespace clamor
