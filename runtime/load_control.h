// load_control.h: what the machine can take: fewer voices before it is late, all of them after.
//
// Two loops, each on the thread whose time it watches; neither waits for the other.
//
//   audio    BlockLoad measures what share of its own time a block takes. Above kHighShare, or
//   where
//            a new keyframe's voices would take it there by what a voice has cost of late, it
//            allows as many as would take kAimShare, and the mixer fades out the rest, those that
//            the sampler would miss least first. Below kLowShare it allows more: twice as many
//            after kDouble_s.
//   sampler  VoiceLimit says how many sources to choose, k. It falls when a keyframe takes more
//   than
//            kHighShare of its period, and by as much as the mixer had to leave out; it rises by
//            kRise a keyframe while both have time to spare, and stays between.
//
// So a sudden burden is first met by the mixer, within a block, which loses what it leaves out, and
// some keyframes later by the sampler, with which loudness is right again: tau, and with it what
// stands for the rest, rises as k falls (sampler.h).
//
// Nothing falls by more than half at once, since one measurement may be of something else, and
// nothing below a floor, where fewer voices would save little.
//
// Both are functions of what they are told: time is measured by their callers, by a clock that may
// be a test's. Threads: any one each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "runtime/realtime.h"

namespace clamor {

// Seconds since some moment. Called on the audio thread: must not wait.
struct LoadClock {
  static double steady_s(void*) noexcept REALTIME;

  double (*now_s)(void* context) noexcept = steady_s;
  void* context = nullptr;
  double now() const noexcept REALTIME { return now_s(context); }
};

inline constexpr double kHighShare = 0.85, kAimShare = 0.7, kLowShare = 0.55;

class BlockLoad {
 public:
  static constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();
  static constexpr double kLeastVoices = 32;
  static constexpr double kDouble_s = 5;

  // That many voices were mixed, for sound that lasts `block_s`, in `took_s`.
  void mixed(double took_s, double block_s, std::size_t voices) noexcept REALTIME;

  // A keyframe has that many voices, which are about to be mixed.
  void expect(std::size_t voices) noexcept REALTIME;

  // How many voices may sound.
  std::size_t allowed() const noexcept REALTIME {
    return allowed_ < kNoLimit ? static_cast<std::size_t>(allowed_) : kUnlimited;
  }

 private:
  static constexpr double kNoLimit = 1e15;

  double allowed_ = kNoLimit;
  double wanted_ = 0;           // voices of the newest keyframe
  double share_per_voice_ = 0;  // smoothed; 0: not known
};

class VoiceLimit {
 public:
  static constexpr double kRise = 1.003;     // a keyframe: twice as many in 4.6 s
  static constexpr std::size_t kFloor = 16;  // the least is the most, divided by this
  static constexpr int kSettle = 12;  // keyframes until what the mixer left out is known anew

  explicit VoiceLimit(std::size_t most) : most_(most), voices_(static_cast<double>(most)) {}

  std::size_t voices() const { return static_cast<std::size_t>(voices_); }
  std::size_t least_so_far() const { return least_so_far_ < most_ ? least_so_far_ : most_; }
  std::uint64_t late() const { return late_; }  // keyframes that took longer than their period

  // A keyframe took such a share of its period, and the mixer is without such a share of the
  // voices that it was given; `full`: it takes no more of them.
  void keyframe_took(double share, double left_out, bool full);

 private:
  void fall_by(double factor);

  const std::size_t most_;
  double voices_;
  std::size_t least_so_far_ = std::numeric_limits<std::size_t>::max();
  int settling_ = 0;
  std::uint64_t late_ = 0;
};

}  // namespace clamor
