// buffer_growth.h: adapts a device's buffer length to its underflows.
//
// A short buffer gives low latency, but how short it may be depends on the device, its server and
// the load of the machine. The buffer therefore starts at kStartBlocks blocks and grows by half
// when the device has run dry twice within kWindow_s, up to kLongest_s. A single underflow may be
// another program's fault and changes nothing. The buffer never shrinks: every change is audible as
// a gap.
//
// Threads: any one.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace clamor {

class BufferGrowth {
 public:
  static constexpr int kStartBlocks = 4;
  static constexpr double kWindow_s = 30, kLongest_s = 0.2;

  // With `grows` false the buffer keeps its initial length.
  BufferGrowth(int block_frames, int rate_hz, bool grows)
      : block_frames_(block_frames), rate_hz_(rate_hz), grows_(grows) {}

  int frames() const { return blocks_ * block_frames_; }

  // Records an underflow. Returns true if the buffer is to be longer from now on.
  bool underflow(double at_s) {
    const bool is_second = at_s - last_s_ <= kWindow_s;
    last_s_ = is_second ? -std::numeric_limits<double>::infinity() : at_s;
    if (!grows_ || !is_second) return false;
    const auto longest = static_cast<int>(kLongest_s * rate_hz_ / block_frames_);
    const int blocks = std::max(blocks_, std::min(blocks_ + (blocks_ + 1) / 2, longest));
    if (blocks == blocks_) return false;
    blocks_ = blocks;
    return true;
  }

 private:
  const int block_frames_, rate_hz_;
  const bool grows_;
  int blocks_ = kStartBlocks;
  double last_s_ = -std::numeric_limits<double>::infinity();
};

}  // namespace clamor
