#include "runtime/mixing/load_control.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

constexpr double kMostAtOnce = 0.5;
// Where blocks take less than this, what else there is to do would be taken for voices.
constexpr double kTellingShare = 0.25;
constexpr double kSmooth_s = 0.1;
constexpr double kForget = 0.05;  // of the worst share, a keyframe

}  // namespace

double LoadClock::steady_s(void*) noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void Backoff::pass(double seconds) noexcept REALTIME {
  since_fall_s_ += seconds;
  if (rose_) since_rise_s_ += seconds;
}

void Backoff::fell() noexcept REALTIME {
  if (rose_) wait_s_ = since_rise_s_ < kSoon_s ? std::min(2 * wait_s_, kMost_s) : kLeast_s;
  rose_ = false;
  since_fall_s_ = since_rise_s_ = 0;
}

void MixerLoadControl::fall_to(double voices) noexcept REALTIME {
  if (voices >= allowed_) return;  // a first fall is still fading out
  allowed_ = voices;
  patience_.fell();
}

void MixerLoadControl::mixed(double took_s, double block_s, std::size_t voices) noexcept {
  if (!(block_s > 0) || voices == 0) return;
  patience_.pass(block_s);
  const double share = took_s / block_s;
  const double count = static_cast<double>(voices);
  const double now = share / count;  // a voice takes no more
  if (share > kTellingShare || now < share_per_voice_) {
    const double smoothing = share_per_voice_ > 0 ? std::min(1.0, block_s / kSmooth_s) : 1;
    share_per_voice_ += smoothing * (now - share_per_voice_);
  }
  const bool was_high = std::exchange(high_, share > kHighShare);
  if (share > 1 || (high_ && was_high)) {
    // Of those that were mixed: the same while a first fall is still fading out.
    fall_to(std::max(kMinVoices, count * std::max(kMostAtOnce, kAimShare / share)));
  } else if (share < kLowShare && allowed_ < kNoLimit && patience_.over()) {
    patience_.rose();
    const double faster = share < kLowShare / 2 ? 2 : 1;
    allowed_ *= std::exp2(faster * block_s / kDouble_s);
    // Once there is as much room again as is needed, the next burden is another one.
    if (allowed_ > 2 * wanted_) allowed_ = kNoLimit;
  }
}

void MixerLoadControl::expect(std::size_t voices) noexcept {
  wanted_ = static_cast<double>(voices);
  if (share_per_voice_ * std::min(wanted_, allowed_) > kHighShare)
    fall_to(std::max(kMinVoices, kAimShare / share_per_voice_));
}

void SamplerLoadControl::fall_by(double factor) {
  const double floor = std::max(1.0, std::floor(static_cast<double>(most_) / kFloor));
  voices_ = std::min(voices_, std::max(floor, voices_ * std::max(kMostAtOnce, factor)));
  min_so_far_ = std::min(min_so_far_, voices());
  patience_.fell();
}

void SamplerLoadControl::keyframe_took(double share, double left_out, bool full) {
  if (share > 1) ++late_;
  if (settling_ > 0) --settling_;
  patience_.pass(kKeyframe_s);
  const double told = std::min(share, 1.0);  // how much worse, the fall has answered
  worst_share_ = std::max(told, worst_share_ + kForget * (told - worst_share_));
  const bool was_high = std::exchange(high_, share > kHighShare);
  if (share > 1 || (high_ && was_high)) {
    fall_by(kAimShare / share);
  } else if (left_out > 0) {
    if (settling_ > 0) return;
    fall_by(1 - left_out);
    settling_ = kSettle;
  } else if (worst_share_ < kLowShare && !full && patience_.over() &&
             voices_ < static_cast<double>(most_)) {
    patience_.rose();
    const double before = voices_;
    voices_ = std::min(static_cast<double>(most_), std::max(voices_ * kRise, voices_ + 0.05));
    worst_share_ *= voices_ / before;  // no keyframe takes more than so many times as long
  }
}

}  // namespace clamor
