#include "runtime/load_control.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace clamor {

namespace {

constexpr double kMostAtOnce = 0.5;
// Where blocks take less than this, what else there is to do would be taken for voices.
constexpr double kTellingShare = 0.25;
constexpr double kSmooth_s = 0.1;

}  // namespace

double LoadClock::steady_s(void*) noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void BlockLoad::mixed(double took_s, double block_s, std::size_t voices) noexcept {
  if (!(block_s > 0) || voices == 0) return;
  const double share = took_s / block_s;
  const double count = static_cast<double>(voices);
  const double now = share / count;  // a voice takes no more
  if (share > kTellingShare || now < share_per_voice_) {
    const double smoothing = share_per_voice_ > 0 ? std::min(1.0, block_s / kSmooth_s) : 1;
    share_per_voice_ += smoothing * (now - share_per_voice_);
  }
  if (share > kHighShare) {
    // Of those that were mixed: the same while a first fall is still fading out.
    const double fewer = count * std::max(kMostAtOnce, kAimShare / share);
    allowed_ = std::min(allowed_, std::max(kLeastVoices, fewer));
  } else if (share < kLowShare && allowed_ < kNoLimit) {
    allowed_ *= std::exp2(block_s / kDouble_s);
    // Once there is as much room again as is needed, the next burden is another one.
    if (allowed_ > 2 * wanted_) allowed_ = kNoLimit;
  }
}

void BlockLoad::expect(std::size_t voices) noexcept {
  wanted_ = static_cast<double>(voices);
  if (share_per_voice_ * std::min(wanted_, allowed_) > kHighShare)
    allowed_ = std::max(kLeastVoices, kAimShare / share_per_voice_);
}

void VoiceLimit::fall_by(double factor) {
  const double floor = std::max(1.0, std::floor(static_cast<double>(most_) / kFloor));
  voices_ = std::min(voices_, std::max(floor, voices_ * std::max(kMostAtOnce, factor)));
  least_so_far_ = std::min(least_so_far_, voices());
}

void VoiceLimit::keyframe_took(double share, double left_out, bool full) {
  if (share > 1) ++late_;
  if (settling_ > 0) --settling_;
  if (share > kHighShare) {
    fall_by(kAimShare / share);
  } else if (left_out > 0) {
    if (settling_ > 0) return;
    fall_by(1 - left_out);
    settling_ = kSettle;
  } else if (share < kLowShare && !full) {
    voices_ = std::min(static_cast<double>(most_), std::max(voices_ * kRise, voices_ + 0.05));
  }
}

}  // namespace clamor
