// buffer_growth.h: how much sound a device should hold ahead of time, learnt from its underflows.
//
// A short buffer means low latency, and nobody knows beforehand how short it may be: that depends
// on the device, its server and what else the machine does. So the buffer starts at kStartBlocks
// blocks and grows by half when the device has run dry twice within kWindow_s, up to kLongest_s. A
// single underflow may be the fault of another program and changes nothing. The buffer never
// shrinks: each change is audible as a gap.
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

  // A buffer that does not grow keeps its first length.
  BufferGrowth(int block_frames, int rate_hz, bool grows)
      : block_frames_(block_frames), rate_hz_(rate_hz), grows_(grows) {}

  int frames() const { return blocks_ * block_frames_; }

  // The device ran dry. Returns true where the buffer is to be longer from now on.
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
