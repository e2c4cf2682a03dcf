// tap_group.h: the taps of one input and one part, with what their gains are computed from.
//
// A source keeps its place in the table while it is chosen, so that only changes are written. A
// source that comes or goes does so over kTapFade_keyframes, linearly: as a voice it goes or comes
// by the same curve (keyframe_maker.h), and both read the same signal at the same delay.
//
// Gains for a distance change less than delays as a listener walks, so they are kept for a while.
//
// Threads: the sampler's. Memory: 430 bytes per tap.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/bands.h"
#include "runtime/mixing/voice_table.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/sampling/sampler.h"

namespace clamor {

class TapGroup {
 public:
  explicit TapGroup(const RadiationModel& radiation) : table_(radiation, 0) {}

  // Takes these sources, ascending by number, in place of the last ones.
  void take(std::span<const SampledSource* const> chosen);

  // Moves all presences by `step` towards what was taken, and drops taps that are gone. Returns
  // whether anything has changed since the last call.
  bool advance(float step);

  VoiceTable& table() { return table_; }
  std::size_t used() const { return used_; }
  // The longest way by which taking has moved a reflection, or has changed its path.
  double moved_m() const { return moved_m_; }
  bool is_empty() const { return by_number_.empty(); }
  // The share of its amplitude with which a tap sounds; 0 for free slots.
  float presence(std::size_t slot) const { return slots_[slot].presence; }

  // A tap's gains at each ear, which whoever fills them in keeps for as long as they do, and the
  // distances for which they are.
  struct Gains {
    std::array<Bands, kEars> at{};
    std::array<float, kEars> distance_m{};
    float low_itd_frames = 0;     // a head's
    std::uint32_t direction = 0;  // the triangle of its mesh in which the tap is
  };
  Gains& gains(std::size_t slot) { return gains_[slot]; }
  // All gains are about to be filled in.
  void begin_gains() { new_gains_ = 0; }
  // Whether so many taps have come or changed since then that the whole is another.
  bool has_other_taps() const { return new_gains_ > by_number_.size() / 8; }
  // Whether a tap's have changed for another reason than the listener since the last call.
  bool take_new_gains(std::size_t slot) { return std::exchange(slots_[slot].has_new_gains, false); }

 private:
  struct Slot {
    float presence = 0;
    bool in_use = false, is_chosen = false, has_new_gains = false;
  };
  struct Entry {
    std::uint64_t number;
    std::uint32_t slot;
  };
  std::uint32_t take_slot();
  void update(std::uint32_t slot, const SampledSource& chosen, bool is_new);

  VoiceTable table_;
  std::vector<Slot> slots_;
  std::vector<Gains> gains_;  // by slot
  std::vector<std::uint32_t> free_;
  std::size_t used_ = 0;                    // slots ever used
  std::vector<Entry> by_number_, updated_;  // ascending
  std::size_t new_gains_ = 0;               // since begin_gains()
  double moved_m_ = 0;
  bool has_changed_ = true;
};

}  // namespace clamor
