// signal_bank.h: signals made ready to be read by voices at any delay.
//
// For eight bands a signal is parted into the octave bank's two layers; for cubic interpolation the
// samples of what is read become half the coefficients of the B-spline through them. There are
// guard samples on both sides, so that one call of the kernel never wraps while it reads. Samples
// that are NaN or infinite become 0 and are counted.
//
// Immutable once made; any thread may read.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "formats/level.h"
#include "runtime/mix_kernel.h"
#include "runtime/realtime.h"

namespace clamor {

class PreparedSignal {
 public:
  PreparedSignal(const Signal& signal, const MixMode& mode);

  // Where a kernel call must read that starts at `position` (32.32, frames of the signal's own
  // time). A loop goes on for ever both ways; a signal that plays once is silent before and after.
  void place(std::int64_t position, VoicePath& path) const noexcept REALTIME {
    if (loops()) {
      if (position < 0 || position >= wrap()) {
        position %= wrap();
        if (position < 0) position += wrap();
      }
    } else if (position < -((front_frames_ + kReach) << 32) || position >= end_frames_ << 32) {
      path.high = path.low = silence();
      path.position = 0;
      return;
    }
    path.position = position;
    path.high = high_.data() + kGuardFrames + front_frames_;
    path.low = low_.data() + (kGuardFrames + front_frames_) / kLowRate;
  }

  // A loop may also be followed by subtracting wrap() once it is reached: none is shorter than what
  // a call may read, because short ones are repeated.
  bool loops() const noexcept REALTIME { return loop_frames_ > 0; }
  std::int64_t wrap() const noexcept REALTIME { return loop_frames_ << 32; }

  // The frame that is as good as any other so many loops away or so long before or after the end.
  std::int64_t near(std::int64_t frame) const noexcept REALTIME;

  const Bands& mean_square() const { return mean_square_; }
  std::uint64_t bad_samples() const { return bad_samples_; }

 private:
  // A call reads no farther: twice as many frames as it mixes, and some vectors.
  static constexpr int kReach = 2 * kMostFrames + 64;
  static constexpr int kGuardFrames = 1024;
  static_assert(kGuardFrames >= kReach + 16 && kGuardFrames % kLowRate == 0);
  static const float* silence() noexcept REALTIME;

  std::vector<float> high_, low_;
  std::int64_t loop_frames_ = 0;   // whole loops; 0: plays once
  std::int64_t front_frames_ = 0;  // what may be heard before frame 0, and where it is over
  std::int64_t end_frames_ = 0;
  Bands mean_square_{};
  std::uint64_t bad_samples_ = 0;
};

std::vector<PreparedSignal> prepare_signals(std::span<const Signal> signals,
                                            const MixMode& mode = {});

}  // namespace clamor
