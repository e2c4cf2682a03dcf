// keyframe_lead.h: predicts how long before its due time a keyframe must be begun.
//
// A keyframe has the listener's position at the moment when it is begun, so the time that it waits
// for the mixer is latency. The lead is the recent maximum of the time that keyframes took (with
// slow decay) plus a reserve for the system's scheduler. The reserve doubles whenever the mixer had
// to hold, and shrinks again within half a minute. So other programs that delay the sampler cost
// latency, up to kMax_s of it, and no voices (load_control.h).
//
// Threads: the sampler's.
#pragma once

#include <algorithm>
#include <cstdint>

namespace clamor {

class KeyframeLead {
 public:
  static constexpr double kMinReserve_s = 0.004, kMaxReserve_s = 0.064, kMax_s = 0.12;

  // `period_s`: the longest time between two looks whether a keyframe must be begun, above a
  // millisecond.
  explicit KeyframeLead(double period_s = 0)
      : min_reserve_s_(kMinReserve_s + period_s),
        max_reserve_s_(kMaxReserve_s + period_s),
        max_s_(kMax_s + period_s),
        reserve_s_(min_reserve_s_) {}

  // Records the time that a keyframe took, and the total number of blocks held so far.
  void made(double took_s, std::uint64_t held_blocks) {
    longest_s_ = std::max(took_s, kForget * longest_s_);
    reserve_s_ = held_blocks > held_blocks_ ? 2 * reserve_s_ : kForgive * reserve_s_;
    reserve_s_ = std::clamp(reserve_s_, min_reserve_s_, max_reserve_s_);
    held_blocks_ = held_blocks;
  }

  double seconds() const { return std::min(1.25 * longest_s_ + reserve_s_, max_s_); }

 private:
  static constexpr double kForget = 0.96;    // halves in 0.3 s
  static constexpr double kForgive = 0.998;  // halves in 7 s

  const double min_reserve_s_, max_reserve_s_, max_s_;
  double longest_s_ = 0, reserve_s_;
  std::uint64_t held_blocks_ = 0;
};

}  // namespace clamor
