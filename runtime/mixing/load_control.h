// load_control.h: load shedding: limits the number of voices to what the machine can process in
// time.
//
// Work is measured twice: by the time that passes and by the thread's own CPU time. ThreadLoad
// tells apart the thread's own load, which fewer voices reduce, and that of other programs, which a
// lead bridges (keyframe_lead.h, buffer_growth.h).
//
// MixerLoadControl, on the audio thread, reduces the number of allowed voices when two measurements
// in a row exceed kHighShare, when one exceeds the time that there is, or when a new keyframe's
// voices would exceed kHighShare at their recent cost. The new limit aims at kAimShare. Below
// kLowShare the limit rises, doubling in kDouble_s, or in half of that with ample time.
//
// SamplerLoadControl, on the sampler's, decides how many keyframes share a sample, and limits k,
// the number of chosen sources, where that is not enough or where the mixer sheds voices. k rises
// by kRise per keyframe while the recent worst share is below kLowShare and the mixer has room.
//
// Between the thresholds both keep their limits. After a fall both wait before they rise, and if
// that rise soon leads to the next fall, the wait doubles (Backoff), but leaves enough of kReturn_s
// for the rise. No step reduces by more than half, since one measurement may be an outlier.
// runtime/README.md, "Load control", says what is heard of it.
//
// Both are functions of their inputs: the callers measure time, with a clock and a CPU meter that a
// test may replace. Threads: any one each.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <limits>

#include "runtime/realtime/realtime.h"

namespace clamor {

// Time that passed during a thread's work, and how much of it was the thread's own CPU time. The
// unit is a second, or the time that there is for the work.
struct WorkTime {
  double passed = 0, cpu = 0;

  constexpr WorkTime() = default;
  constexpr WorkTime(double passing, double own) : passed(passing), cpu(own) {}
  // Without a meter, all time is the thread's own.
  constexpr WorkTime(double time) : passed(time), cpu(time) {}  // NOLINT(*-explicit-*)

  constexpr WorkTime operator+(const WorkTime& b) const { return {passed + b.passed, cpu + b.cpu}; }
  constexpr WorkTime operator-(const WorkTime& b) const { return {passed - b.passed, cpu - b.cpu}; }
  constexpr WorkTime operator*(double by) const { return {passed * by, cpu * by}; }
};

// The clock and the meter of CPU time.
struct LoadClock {
  static double steady_s(void*) noexcept REALTIME;
  static LoadClock of_machine();

  // Seconds since an arbitrary moment. Called on the audio thread, so it must not wait.
  double (*now_s)(void* context) noexcept = steady_s;
  void* context = nullptr;
  // CPU time of a thread, by its clock. Null: threads never wait for a core. A system call, so it
  // is called on the sampler's thread only.
  double (*cpu_s)(void* context, clockid_t thread) noexcept = nullptr;

  double now() const noexcept REALTIME { return now_s(context); }
  // Work of the calling thread so far.
  WorkTime work() const {
    const double passed_s = now();
    return cpu_s == nullptr ? passed_s
                            : WorkTime(passed_s, cpu_s(context, CLOCK_THREAD_CPUTIME_ID));
  }
};

inline constexpr double kHighShare = 0.9, kAimShare = 0.75, kLowShare = 0.65;

// Tells a thread's own load from that of others.
class ThreadLoad {
 public:
  // Others' load is averaged so long, which a lead bridges.
  static constexpr double kAverage_s = 0.5;
  // At most so much of a measurement counts: a stall does not tell how much of a core there is.
  static constexpr double kMaxPassed = 4;
  // Others take part where more time passes than CPU time times this.
  static constexpr double kWaits = 1.1;

  // Records the share of `period_s` that the work for this time took.
  void worked(const WorkTime& share, double period_s) noexcept REALTIME;

  double own() const noexcept REALTIME { return own_; }  // the newest share
  // The share that must be reduced to kAimShare, or 0: of its own load, or on average with the
  // wait.
  double own_excess() const noexcept REALTIME {
    return own_ > 1 || (high_ && was_high_) ? own_ : 0;
  }
  double mean_excess() const noexcept REALTIME {
    return waits() && mean_.passed > kHighShare ? mean_.passed : 0;
  }
  // Whether there is room for `more` times the work, and then for some.
  bool has_room(double more = 1) const noexcept REALTIME {
    return more * own_ < kLowShare && (!waits() || more * mean_.passed < kLowShare);
  }
  // The work will be multiplied by this.
  void scale(double factor) noexcept REALTIME { mean_ = mean_ * factor; }

  // The share of its time that the thread waited for a core.
  double waiting_share() const noexcept REALTIME {
    return waits() ? 1 - mean_.cpu / mean_.passed : 0;
  }

 private:
  bool waits() const noexcept REALTIME { return mean_.passed > kWaits * mean_.cpu; }

  double own_ = 0;
  bool high_ = false, was_high_ = false;
  WorkTime mean_;
};

// The wait between a fall and the next rise.
class Backoff {
 public:
  static constexpr double kMinWait_s = 0.25, kMaxWait_s = 4;
  // From a fall until all voices are back, if there is time for them.
  static constexpr double kReturn_s = 3.75;
  // A fall this soon after the start of a rise was caused by it.
  static constexpr double kSoon_s = 5;

  void pass(double seconds) noexcept REALTIME;
  void rose() noexcept REALTIME { rose_ = true; }
  void fell() noexcept REALTIME;
  // `rise_s`: what the rise takes.
  bool over(double rise_s) const noexcept REALTIME {
    return since_fall_s_ >= std::min(wait_s_, kReturn_s - rise_s);
  }

 private:
  double since_fall_s_ = 0, since_rise_s_ = kSoon_s, wait_s_ = 0;
  bool rose_ = true;  // since the last fall
};

class MixerLoadControl {
 public:
  static constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();
  static constexpr double kMinVoices = 32;
  static constexpr double kDouble_s = 0.7;

  // Records that mixing `voices` voices for `block_s` of sound took so many seconds.
  void mixed(const WorkTime& took, double block_s, std::size_t voices) noexcept REALTIME;

  // Announces the number of voices of a keyframe that is about to be mixed.
  void expect(std::size_t voices) noexcept REALTIME;

  // Number of voices that may sound.
  std::size_t allowed() const noexcept REALTIME {
    return allowed_ < kNoLimit ? static_cast<std::size_t>(allowed_) : kUnlimited;
  }

  // Returns whether there is no time for more than `voices` voices.
  bool is_full(std::size_t voices) const noexcept REALTIME {
    const auto count = static_cast<double>(voices);
    return allowed_ < kNearly * count || share_per_voice_ * count > kLowShare || !load_.has_room();
  }

 private:
  static constexpr double kNoLimit = 1e15;
  static constexpr double kNearly = 1.02;

  bool fall_to(double voices) noexcept REALTIME;

  double allowed_ = kNoLimit;
  double wanted_ = 0;           // voices of the newest keyframe
  double share_per_voice_ = 0;  // of CPU time, smoothed; 0: unknown
  ThreadLoad load_;
  Backoff backoff_;
};

class SamplerLoadControl {
 public:
  static constexpr double kRise = 1.02;      // per keyframe: doubles in 0.7 s
  static constexpr std::size_t kFloor = 16;  // the minimum is the maximum divided by this
  // Keyframes until a reduction shows in the mixer's share of shed voices.
  static constexpr int kSettle = 12;

  // A sample serves `spacing.least` keyframes and, where time is short, up to `spacing.most`.
  struct Spacing {
    std::size_t least = 1, most = 1;
  };
  explicit SamplerLoadControl(std::size_t max_voices) : SamplerLoadControl(max_voices, {1, 1}) {}
  SamplerLoadControl(std::size_t max_voices, Spacing spacing)
      : max_voices_(max_voices),
        limits_(spacing),
        spacing_(spacing.least),
        voices_(static_cast<double>(max_voices)) {}

  std::size_t spacing() const { return spacing_; }
  std::size_t voices() const { return static_cast<std::size_t>(voices_); }
  std::size_t min_so_far() const { return min_so_far_ < max_voices_ ? min_so_far_ : max_voices_; }
  std::uint64_t late() const { return late_; }  // keyframes that took longer than their period
  std::uint64_t starved() const { return starved_; }  // late for want of a core alone
  double waiting_share() const { return load_.waiting_share(); }

  // Records the share of its period that a keyframe took and the share of voices that the mixer
  // sheds; `full`: the mixer has no time for more.
  void keyframe_took(const WorkTime& share, double shed, bool full);

 private:
  void answer(double excess);
  void fall_by(double factor);
  void space(std::size_t keyframes);
  double rise_s() const;  // to the maximum

  const std::size_t max_voices_;
  const Spacing limits_;
  std::size_t spacing_;
  double voices_;
  std::size_t min_so_far_ = std::numeric_limits<std::size_t>::max();
  double worst_share_ = 0;  // recent maximum, scaled to the current number of voices
  ThreadLoad load_;
  int settling_ = 0;
  std::uint64_t late_ = 0, starved_ = 0;
  Backoff backoff_;
};

}  // namespace clamor
