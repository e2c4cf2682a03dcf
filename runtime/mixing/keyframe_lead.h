// keyframe_lead.h: how long before it is due a keyframe should be begun.
//
// A keyframe holds the listener's place at the moment when it is begun, so every millisecond that
// it waits for the mixer is latency. The lead is what keyframes have taken of late, the longest of
// them counting most, and some reserve for the system's scheduler; where the mixer has nevertheless
// had to hold, the reserve doubles, and then shrinks again within half a minute.
//
// Threads: the sampler's.
#pragma once

#include <algorithm>
#include <cstdint>

namespace clamor {

class KeyframeLead {
 public:
  static constexpr double kMinReserve_s = 0.004, kMaxReserve_s = 0.064;

  // A keyframe took so long; the mixer has held so many blocks so far.
  void made(double took_s, std::uint64_t held_blocks) {
    longest_s_ = std::max(took_s, kForget * longest_s_);
    reserve_s_ = held_blocks > held_blocks_ ? 2 * reserve_s_ : kForgive * reserve_s_;
    reserve_s_ = std::clamp(reserve_s_, kMinReserve_s, kMaxReserve_s);
    held_blocks_ = held_blocks;
  }

  double seconds() const { return 1.25 * longest_s_ + reserve_s_; }

 private:
  static constexpr double kForget = 0.96;    // by half in 0.3 s
  static constexpr double kForgive = 0.998;  // by half in 7 s

  double longest_s_ = 0, reserve_s_ = kMinReserve_s;
  std::uint64_t held_blocks_ = 0;
};

}  // namespace clamor
