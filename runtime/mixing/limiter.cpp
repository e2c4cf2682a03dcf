#include "runtime/mixing/limiter.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/sample_rate.h"

namespace clamor {

namespace {

// Two phases of BS.1770-4's interpolation filter; the other two are these reversed.
constexpr float kPhase0[12] = {0.0017089843750f,  0.0109863281250f,  -0.0196533203125f,
                               0.0332031250000f,  -0.0594482421875f, 0.1373291015625f,
                               0.9721679687500f,  -0.1022949218750f, 0.0476074218750f,
                               -0.0266113281250f, 0.0148925781250f,  -0.0083007812500f};
constexpr float kPhase1[12] = {-0.0291748046875f, 0.0292968750000f,  -0.0517578125000f,
                               0.0891113281250f,  -0.1665039062500f, 0.4650878906250f,
                               0.7797851562500f,  -0.2003173828125f, 0.1015625000000f,
                               -0.0582275390625f, 0.0330810546875f,  -0.0189208984375f};

const float kCeiling = static_cast<float>(std::pow(10, kLimiterCeiling_db / 20));
const float kRelease =
    static_cast<float>(std::pow(10, 3.0 / 20 / (0.1 * kSampleRate_hz)));  // gain per frame

}  // namespace

Limiter::Limiter(std::size_t channels)
    : channels_(channels), delayed_(channels * kLimiterDelayFrames), peak_(channels) {}

float Limiter::TruePeak::after(const float* frame) noexcept REALTIME {
  for (std::size_t c = 0; c < channels_; ++c) {
    float* const newest = newest_.data() + c * 2 * kTaps + at_;
    newest[0] = newest[kTaps] = frame[c];
  }
  at_ = (at_ + 1) % kTaps;
  float peak = 0;
  for (std::size_t c = 0; c < channels_; ++c) {
    const float* x = newest_.data() + c * 2 * kTaps + at_;  // oldest first
    float highest = 0;
    for (int k = 0; k < kTaps; ++k) highest = std::max(highest, std::abs(x[k]));
    peak = std::max(peak, highest);
    // The sum of absolute taps is below 1.7, so no interpolated sample can exceed the ceiling.
    if (highest * 1.7f <= kCeiling) continue;
    float sum[kPhases] = {};
    for (int k = 0; k < kTaps; ++k) {
      sum[0] += kPhase0[k] * x[k];
      sum[1] += kPhase1[k] * x[k];
      sum[2] += kPhase1[kTaps - 1 - k] * x[k];
      sum[3] += kPhase0[kTaps - 1 - k] * x[k];
    }
    for (const float s : sum) peak = std::max(peak, std::abs(s));
  }
  return peak;
}

Limiter::GainReduction::GainReduction() {
  required_.fill(1);
  held_.fill(1);
}

float Limiter::GainReduction::after(float peak) noexcept REALTIME {
  if (!(peak <= kCeiling)) busy_frames_ = 2 * kWindow;
  if (busy_frames_ == 0) return 1;
  required_[at_] = peak <= kCeiling ? 1 : kCeiling / peak;
  const float lowest = *std::ranges::min_element(required_);
  released_ = std::min(lowest, released_ * kRelease);
  sum_ += static_cast<double>(released_) - static_cast<double>(held_[at_]);
  held_[at_] = released_;
  at_ = (at_ + 1) % kWindow;
  const float gain = std::min(1.0f, static_cast<float>(sum_ / kWindow));
  if (released_ >= 1 && lowest >= 1 && --busy_frames_ == 0) sum_ = kWindow;
  return gain;
}

void Limiter::process(std::span<float> interleaved) noexcept REALTIME {
  assert(interleaved.size() % channels_ == 0);
  std::uint64_t limited = 0;
  float min_gain = 1;
  for (std::size_t i = 0; i < interleaved.size(); i += channels_) {
    float* const frame = interleaved.data() + i;
    const float gain = gain_.after(peak_.after(frame));
    float* const delayed = delayed_.data() + at_ * channels_;
    for (std::size_t c = 0; c < channels_; ++c) {
      const float out = gain < 1 ? delayed[c] * gain : delayed[c];
      delayed[c] = frame[c];
      frame[c] = out;
    }
    at_ = (at_ + 1) % kLimiterDelayFrames;
    limited += gain < 1;
    min_gain = std::min(min_gain, gain);
  }
  if (limited == 0) return;
  limited_.fetch_add(limited, std::memory_order_relaxed);
  if (min_gain < min_gain_.load(std::memory_order_relaxed))
    min_gain_.store(min_gain, std::memory_order_relaxed);
}

Limiter::Work Limiter::worked() const noexcept {
  return {limited_.load(std::memory_order_relaxed), min_gain_.load(std::memory_order_relaxed)};
}

}  // namespace clamor
