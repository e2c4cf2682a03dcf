#include "runtime/mixing/load_control.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "common/cpu_time.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

constexpr double kMinKeptShare = 0.5;  // of the voices, by one reduction
// Below this share of a block, fixed costs would be mistaken for the cost of voices.
constexpr double kTellingShare = 0.25;
constexpr double kSmooth_s = 0.1;
constexpr double kForget = 0.05;  // decay of the worst share per keyframe

double cpu_time_of(void*, clockid_t thread) noexcept { return cpu_time_s(thread); }

}  // namespace

double LoadClock::steady_s(void*) noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

LoadClock LoadClock::of_machine() { return {steady_s, nullptr, cpu_time_of}; }

void ThreadLoad::worked(const WorkTime& share, double period_s) noexcept REALTIME {
  own_ = share.cpu;
  was_high_ = std::exchange(high_, own_ > kHighShare);
  const double weight = std::min(1.0, period_s / kAverage_s);
  mean_.passed += weight * (std::min(share.passed, kMaxPassed) - mean_.passed);
  mean_.cpu += weight * (std::min(share.cpu, kMaxPassed) - mean_.cpu);
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

bool MixerLoadControl::fall_to(double voices) noexcept REALTIME {
  if (voices >= allowed_) return false;  // the previous reduction is still fading out
  allowed_ = voices;
  backoff_.fell();
  return true;
}

void MixerLoadControl::mixed(const WorkTime& took, double block_s, std::size_t voices) noexcept {
  if (!(block_s > 0) || voices == 0) return;
  backoff_.pass(block_s);
  load_.worked(took * (1 / block_s), block_s);
  const double share = load_.own();
  const double count = static_cast<double>(voices);
  const double now = share / count;  // an upper bound on the cost of a voice
  if (share > kTellingShare || now < share_per_voice_) {
    const double smoothing = share_per_voice_ > 0 ? std::min(1.0, block_s / kSmooth_s) : 1;
    share_per_voice_ += smoothing * (now - share_per_voice_);
  }
  if (const double excess = std::max(load_.own_excess(), load_.mean_excess()); excess > 0) {
    // Relative to the voices that were mixed, which do not change while a reduction fades out.
    const double kept = std::max(kMinKeptShare, kAimShare / excess);
    if (fall_to(std::max(kMinVoices, kept * count))) load_.scale(kept);
  } else if (load_.has_room() && allowed_ < kNoLimit &&
             backoff_.over(kDouble_s * std::log2(2 * wanted_ / allowed_))) {
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
    (void)fall_to(std::max(kMinVoices, kAimShare / share_per_voice_));
}

void SamplerLoadControl::fall_by(double factor) {
  const double floor = std::max(1.0, std::floor(static_cast<double>(max_voices_) / kFloor));
  const double kept = std::max(kMinKeptShare, factor);
  voices_ = std::min(voices_, std::max(floor, voices_ * kept));
  min_so_far_ = std::min(min_so_far_, voices());
  load_.scale(kept);
  backoff_.fell();
}

// A sample's time is shared by so many keyframes from now on.
void SamplerLoadControl::space(std::size_t keyframes) {
  const double factor = static_cast<double>(spacing_) / static_cast<double>(keyframes);
  load_.scale(factor);
  worst_share_ = std::min(1.0, worst_share_ * factor);
  spacing_ = keyframes;
}

// More keyframes share a sample, as many as it takes if all of the time is a sample's; what is
// still too much after that is met by fewer voices.
void SamplerLoadControl::answer(double excess) {
  const auto before = static_cast<double>(spacing_);
  const double enough = std::ceil(before * excess / kAimShare);
  space(static_cast<std::size_t>(std::min(enough, static_cast<double>(limits_.most))));
  const double left = excess * before / static_cast<double>(spacing_);
  if (left > kHighShare) return fall_by(kAimShare / left);
  backoff_.fell();
}

void SamplerLoadControl::keyframe_took(const WorkTime& share, double shed, bool full) {
  if (share.passed > 1) ++late_;
  if (share.passed > 1 && share.cpu <= 1) ++starved_;
  if (settling_ > 0) --settling_;
  backoff_.pass(kKeyframe_s);
  load_.worked(share, kKeyframe_s);
  const double reported = std::min(share.cpu, 1.0);  // the reduction has answered anything beyond
  worst_share_ = std::max(reported, worst_share_ + kForget * (reported - worst_share_));
  const bool all_voices = voices_ >= static_cast<double>(max_voices_);
  if (const double excess = std::max(load_.own_excess(), load_.mean_excess()); excess > 0) {
    answer(excess);
  } else if (shed > 0) {
    if (settling_ > 0) return;
    fall_by(1 - shed);
    settling_ = kSettle;
  } else if (!all_voices && !full && backoff_.over(rise_s())) {
    if (worst_share_ < kLowShare && load_.has_room()) {
      backoff_.rose();
      const double before = voices_;
      voices_ =
          std::min(static_cast<double>(max_voices_), std::max(voices_ * kRise, voices_ + 0.05));
      // A keyframe with more voices takes at most proportionally longer.
      worst_share_ *= voices_ / before;
    } else if (spacing_ < limits_.most) {
      space(spacing_ + 1);
    }
  } else if (spacing_ > limits_.least && backoff_.over(0)) {
    const double more = static_cast<double>(spacing_) / static_cast<double>(spacing_ - 1);
    if (more * worst_share_ >= kLowShare || !load_.has_room(more)) return;
    backoff_.rose();
    space(spacing_ - 1);
  }
}

double SamplerLoadControl::rise_s() const {
  return kKeyframe_s * std::log(static_cast<double>(max_voices_) / voices_) / std::log(kRise);
}

}  // namespace clamor
