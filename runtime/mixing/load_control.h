// load_control.h: load shedding: limits the number of voices to what the machine can process in
// time.
//
// Two control loops run on the threads whose time they measure. Neither waits for the other.
//
// MixerLoadControl, on the audio thread, measures the share of real time that a block takes. It
// reduces the number of allowed voices when two blocks in a row exceed kHighShare (a single one may
// be another program's fault), when a block is late, or when a new keyframe's voices would exceed
// it at their recent cost. The new limit aims at kAimShare; the mixer fades out the voices that the
// sampler would miss least. Below kLowShare the limit rises, doubling in kDouble_s, or in half of
// that with ample time.
//
// SamplerLoadControl limits k, the number of chosen sources. It reduces k when a keyframe is late
// or two in a row take more than kHighShare of their period, and in proportion to the voices that
// the mixer sheds. It raises k by kRise per keyframe while the recent worst share is below
// kLowShare and the mixer has room: all its voices are allowed and take less than kLowShare of a
// block.
//
// Between the thresholds both keep their limits (hysteresis): the load must grow by a third before
// a rise is followed by a fall. After a fall both wait before they rise. If a rise soon leads to
// the next fall, the wait doubles (Backoff), so that an intermittent load is met by a low limit.
//
// A sudden load is thus first met by the mixer, within a block, which loses the voices that it
// sheds. Some keyframes later the sampler follows and restores the loudness: tau, and with it the
// power scale of each voice, rises as k falls (sampler.h). When the load has gone, all voices are
// back within 4 s, even from a sixteenth of them.
//
// No step reduces by more than half, since one measurement may be an outlier, and there is a floor
// below which fewer voices would save little.
//
// Both are functions of their inputs: the callers measure time, with a clock that a test may
// replace. Threads: any one each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "runtime/realtime/realtime.h"

namespace clamor {

// Seconds since an arbitrary moment. Called on the audio thread, so it must not wait.
struct LoadClock {
  static double steady_s(void*) noexcept REALTIME;

  double (*now_s)(void* context) noexcept = steady_s;
  void* context = nullptr;
  double now() const noexcept REALTIME { return now_s(context); }
};

inline constexpr double kHighShare = 0.9, kAimShare = 0.75, kLowShare = 0.65;

// The wait between a fall and the next rise.
class Backoff {
 public:
  static constexpr double kMinWait_s = 0.25, kMaxWait_s = 4;
  // A fall this soon after the start of a rise was caused by it.
  static constexpr double kSoon_s = 5;

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

  // Records that mixing `voices` voices for `block_s` of sound took `took_s`.
  void mixed(double took_s, double block_s, std::size_t voices) noexcept REALTIME;

  // Announces the number of voices of a keyframe that is about to be mixed.
  void expect(std::size_t voices) noexcept REALTIME;

  // Number of voices that may sound.
  std::size_t allowed() const noexcept REALTIME {
    return allowed_ < kNoLimit ? static_cast<std::size_t>(allowed_) : kUnlimited;
  }

  // Returns whether there is no time for more than `voices` voices.
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
  double share_per_voice_ = 0;  // smoothed; 0: unknown
  bool high_ = false;           // of the last block
  Backoff backoff_;
};

class SamplerLoadControl {
 public:
  static constexpr double kRise = 1.02;      // per keyframe: doubles in 0.7 s
  static constexpr std::size_t kFloor = 16;  // the minimum is the maximum divided by this
  // Keyframes until a reduction shows in the mixer's share of shed voices.
  static constexpr int kSettle = 12;

  explicit SamplerLoadControl(std::size_t max_voices)
      : max_voices_(max_voices), voices_(static_cast<double>(max_voices)) {}

  std::size_t voices() const { return static_cast<std::size_t>(voices_); }
  std::size_t min_so_far() const { return min_so_far_ < max_voices_ ? min_so_far_ : max_voices_; }
  std::uint64_t late() const { return late_; }  // keyframes that took longer than their period

  // Records the share of its period that a keyframe took and the share of voices that the mixer
  // sheds; `full`: the mixer has no time for more.
  void keyframe_took(double share, double shed, bool full);

 private:
  void fall_by(double factor);

  const std::size_t max_voices_;
  double voices_;
  std::size_t min_so_far_ = std::numeric_limits<std::size_t>::max();
  double worst_share_ = 0;  // recent maximum, scaled to the current number of voices
  bool high_ = false;       // of the last keyframe
  int settling_ = 0;
  std::uint64_t late_ = 0;
  Backoff backoff_;
};

}  // namespace clamor
