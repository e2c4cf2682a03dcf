#include "runtime/mixing/load_control.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

constexpr double kMinKeptShare = 0.5;  // of the voices, by one reduction
// Below this share of a block, fixed costs would be mistaken for the cost of voices.
constexpr double kTellingShare = 0.25;
constexpr double kSmooth_s = 0.1;
constexpr double kForget = 0.05;  // decay of the worst share per keyframe

}  // namespace

double LoadClock::steady_s(void*) noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void Backoff::pass(double seconds) noexcept REALTIME {
  since_fall_s_ += seconds;
  if (rose_) since_rise_s_ += seconds;
}

void Backoff::fell() noexcept REALTIME {
  if (rose_) wait_s_ = since_rise_s_ < kSoon_s ? std::min(2 * wait_s_, kMaxWait_s) : kMinWait_s;
  rose_ = false;
  since_fall_s_ = since_rise_s_ = 0;
}

void MixerLoadControl::fall_to(double voices) noexcept REALTIME {
  if (voices >= allowed_) return;  // the previous reduction is still fading out
  allowed_ = voices;
  backoff_.fell();
}

void MixerLoadControl::mixed(double took_s, double block_s, std::size_t voices) noexcept {
  if (!(block_s > 0) || voices == 0) return;
  backoff_.pass(block_s);
  const double share = took_s / block_s;
  const double count = static_cast<double>(voices);
  const double now = share / count;  // an upper bound on the cost of a voice
  if (share > kTellingShare || now < share_per_voice_) {
    const double smoothing = share_per_voice_ > 0 ? std::min(1.0, block_s / kSmooth_s) : 1;
    share_per_voice_ += smoothing * (now - share_per_voice_);
  }
  const bool was_high = std::exchange(high_, share > kHighShare);
  if (share > 1 || (high_ && was_high)) {
    // Relative to the voices that were mixed, which do not change while a reduction fades out.
    fall_to(std::max(kMinVoices, count * std::max(kMinKeptShare, kAimShare / share)));
  } else if (share < kLowShare && allowed_ < kNoLimit && backoff_.over()) {
    backoff_.rose();
    const double faster = share < kLowShare / 2 ? 2 : 1;
    allowed_ *= std::exp2(faster * block_s / kDouble_s);
    // Lift the limit once there is room for twice the voices: the next overload will be another
    // one.
    if (allowed_ > 2 * wanted_) allowed_ = kNoLimit;
  }
}

void MixerLoadControl::expect(std::size_t voices) noexcept {
  wanted_ = static_cast<double>(voices);
  if (share_per_voice_ * std::min(wanted_, allowed_) > kHighShare)
    fall_to(std::max(kMinVoices, kAimShare / share_per_voice_));
}

void SamplerLoadControl::fall_by(double factor) {
  const double floor = std::max(1.0, std::floor(static_cast<double>(max_voices_) / kFloor));
  voices_ = std::min(voices_, std::max(floor, voices_ * std::max(kMinKeptShare, factor)));
  min_so_far_ = std::min(min_so_far_, voices());
  backoff_.fell();
}

void SamplerLoadControl::keyframe_took(double share, double shed, bool full) {
  if (share > 1) ++late_;
  if (settling_ > 0) --settling_;
  backoff_.pass(kKeyframe_s);
  const double reported = std::min(share, 1.0);  // the reduction has answered anything beyond
  worst_share_ = std::max(reported, worst_share_ + kForget * (reported - worst_share_));
  const bool was_high = std::exchange(high_, share > kHighShare);
  if (share > 1 || (high_ && was_high)) {
    fall_by(kAimShare / share);
  } else if (shed > 0) {
    if (settling_ > 0) return;
    fall_by(1 - shed);
    settling_ = kSettle;
  } else if (worst_share_ < kLowShare && !full && backoff_.over() &&
             voices_ < static_cast<double>(max_voices_)) {
    backoff_.rose();
    const double before = voices_;
    voices_ = std::min(static_cast<double>(max_voices_), std::max(voices_ * kRise, voices_ + 0.05));
    // A keyframe with more voices takes at most proportionally longer.
    worst_share_ *= voices_ / before;
  }
}

}  // namespace clamor
