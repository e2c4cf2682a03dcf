// load_control.h: what the machine can take: fewer voices before it is late, all of them after.
//
// Two loops, each on the thread whose time it watches; neither waits for the other.
//
// The audio thread's, MixerLoadControl, measures what share of its own time a block takes. Above
// kHighShare in two blocks running (a single one that was in time may be any other program's), in
// one that was late, or where a new keyframe's voices would take it there by what a voice has cost
// of late, it allows as many as would take kAimShare, and the mixer fades out the rest, those that
// the sampler would miss least first. Below kLowShare it allows more: twice as many after
// kDouble_s, where there is time for far more, after half of that.
//
// The sampler's, SamplerLoadControl, says how many sources to choose, k. It falls when a keyframe
// is late or two running take above kHighShare of their period, and by as much as the mixer had to
// leave out. It rises by kRise a keyframe while the worst of the last keyframes took less than
// kLowShare, and the mixer takes more: all that it has are allowed, and take less than kLowShare of
// a block.
//
// In between both stay as they are: a burden would have to grow by a third for a fall after a rise.
// After a fall both wait before they rise; where a rise soon led to the next fall, twice as long
// as the last time (Backoff): a burden that comes and goes is met by staying low.
//
// So a sudden burden is first met by the mixer, within a block, which loses what it leaves out, and
// some keyframes later by the sampler, with which loudness is right again: tau, and with it what
// stands for the rest, rises as k falls (sampler.h). When it has gone, all voices are back within
// 4 s, from a sixteenth of them.
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

#include "runtime/realtime/realtime.h"

namespace clamor {

// Seconds since some moment. Called on the audio thread: must not wait.
struct LoadClock {
  static double steady_s(void*) noexcept REALTIME;

  double (*now_s)(void* context) noexcept = steady_s;
  void* context = nullptr;
  double now() const noexcept REALTIME { return now_s(context); }
};

inline constexpr double kHighShare = 0.9, kAimShare = 0.75, kLowShare = 0.65;

// How long to wait after a fall before rising again.
class Backoff {
 public:
  static constexpr double kLeast_s = 0.25, kMost_s = 4;
  static constexpr double kSoon_s = 5;  // a fall that soon after a rise began is due to it

  void pass(double seconds) noexcept REALTIME;
  void rose() noexcept REALTIME { rose_ = true; }
  void fell() noexcept REALTIME;
  bool over() const noexcept REALTIME { return since_fall_s_ >= wait_s_; }

 private:
  double since_fall_s_ = 0, since_rise_s_ = kSoon_s, wait_s_ = 0;
  bool rose_ = true;  // since the last fall
};

class MixerLoadControl {
 public:
  static constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();
  static constexpr double kMinVoices = 32;
  static constexpr double kDouble_s = 0.7;

  // That many voices were mixed, for sound that lasts `block_s`, in `took_s`.
  void mixed(double took_s, double block_s, std::size_t voices) noexcept REALTIME;

  // A keyframe has that many voices, which are about to be mixed.
  void expect(std::size_t voices) noexcept REALTIME;

  // How many voices may sound.
  std::size_t allowed() const noexcept REALTIME {
    return allowed_ < kNoLimit ? static_cast<std::size_t>(allowed_) : kUnlimited;
  }

  // Is there no time for more than that many?
  bool is_full(std::size_t voices) const noexcept REALTIME {
    const auto count = static_cast<double>(voices);
    return allowed_ < kNearly * count || share_per_voice_ * count > kLowShare;
  }

 private:
  static constexpr double kNoLimit = 1e15;
  static constexpr double kNearly = 1.02;

  void fall_to(double voices) noexcept REALTIME;

  double allowed_ = kNoLimit;
  double wanted_ = 0;           // voices of the newest keyframe
  double share_per_voice_ = 0;  // smoothed; 0: not known
  bool high_ = false;           // the last block's share
  Backoff patience_;
};

class SamplerLoadControl {
 public:
  static constexpr double kRise = 1.02;      // a keyframe: twice as many in 0.7 s
  static constexpr std::size_t kFloor = 16;  // the least is the most, divided by this
  static constexpr int kSettle = 12;  // keyframes until what the mixer left out is known anew

  explicit SamplerLoadControl(std::size_t most) : most_(most), voices_(static_cast<double>(most)) {}

  std::size_t voices() const { return static_cast<std::size_t>(voices_); }
  std::size_t min_so_far() const { return min_so_far_ < most_ ? min_so_far_ : most_; }
  std::uint64_t late() const { return late_; }  // keyframes that took longer than their period

  // A keyframe took such a share of its period, and the mixer is without such a share of the
  // voices that it was given; `full`: it takes no more of them.
  void keyframe_took(double share, double left_out, bool full);

 private:
  void fall_by(double factor);

  const std::size_t most_;
  double voices_;
  std::size_t min_so_far_ = std::numeric_limits<std::size_t>::max();
  double worst_share_ = 0;  // of late, as it would be with as many voices as now, or more
  bool high_ = false;       // the last keyframe's share
  int settling_ = 0;
  std::uint64_t late_ = 0;
  Backoff patience_;
};

}  // namespace clamor
