// signal_bank.h: signals made ready to be read by voices at any delay.
//
// Each has the octave bank's phase taken out, guard samples on both sides so that a step of a voice
// never wraps while it reads, and its mean square per band for the sampler's weights. Samples that
// are NaN or infinite become 0 and are counted.
//
// Immutable once made; any thread may read.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "formats/level.h"
#include "runtime/octave_bank.h"
#include "runtime/realtime.h"

namespace clamor {

inline constexpr int kGuardFrames = 256;  // more than KernelVoice asks for

class PreparedSignal {
 public:
  explicit PreparedSignal(const Signal& signal);

  // Where frame `frame` of the signal's own time is, with kGuardFrames - 64 valid ones on both
  // sides. A loop goes on for ever both ways; a signal that plays once is silent before and after.
  const float* at(std::int64_t frame) const noexcept REALTIME {
    if (length_ == 0) return silence();
    if (loop_) {
      frame %= length_;
      return samples_.data() + kGuardFrames + (frame < 0 ? frame + length_ : frame);
    }
    if (frame < -kBankTailFrames - kReach || frame >= length_ + 2) return silence();
    return samples_.data() + kGuardFrames + kBankTailFrames + frame;
  }

  const Bands& mean_square() const { return mean_square_; }
  std::uint64_t bad_samples() const { return bad_samples_; }

 private:
  static constexpr int kReach = 2 * kStepFrames + 16;  // a step reads no farther than this
  static const float* silence() noexcept REALTIME;

  std::vector<float> samples_;
  std::int64_t length_ = 0;  // without guards and tail
  bool loop_ = false;
  Bands mean_square_{};
  std::uint64_t bad_samples_ = 0;
};

std::vector<PreparedSignal> prepare_signals(std::span<const Signal> signals);

}  // namespace clamor
