// sound_device.h: a simulated device that plays an auralizer through the player's callback and
// resampler, as fast as the test likes, with its own clock.
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer_statistics.h"
#include "runtime/output/device_feed.h"
#include "runtime/player/audio_callback.h"

namespace clamor::testing {

struct NoGuard {};

class SoundDevice {
 public:
  SoundDevice(std::unique_ptr<Auralizer> auralizer, int rate_hz, std::size_t max_frames)
      : channels_(static_cast<std::size_t>(auralizer->channels())),
        auralizer_(std::move(auralizer)),
        callback_(*auralizer_, &recorded_, 0, &metered_),
        gate_(std::make_shared<CallbackGate>(OutputCallback{&SoundDevice::fill, this})),
        feed_(gate_, 1, static_cast<int>(channels_)),
        rate_hz_(rate_hz),
        block_(max_frames * channels_) {
    EXPECT_TRUE(feed_.prepare(rate_hz, static_cast<int>(max_frames)).ok());
    gate_->give_to(1);
  }
  SoundDevice(const SoundDevice&) = delete;
  SoundDevice& operator=(const SoundDevice&) = delete;

  // Makes all keyframes that are due, each with the listener's pose at its time.
  template <class PoseAt>
  void make_keyframes(PoseAt pose_at) {
    while (auralizer_->wants_keyframe())
      auralizer_->make_keyframe(pose_at(auralizer_->next_keyframe_time_s()));
  }

  // One callback, with a Guard during the call. The frames are valid until the next call.
  template <class Guard = NoGuard>
  std::span<const float> call(std::size_t frames) {
    const std::span<float> part = std::span(block_).first(frames * channels_);
    time_s_ += static_cast<double>(frames) / rate_hz_;
    const auto now = start_ + std::chrono::duration_cast<DeviceFeed::Clock::duration>(
                                  std::chrono::duration<double>(time_s_));
    {
      [[maybe_unused]] const Guard guard;
      feed_.fill_at(now, part.data(), static_cast<std::uint32_t>(frames), false);
    }
    for (const float sample : part) energy_ += static_cast<double>(sample) * sample;
    while (recorded_.read(drained_) > 0 || metered_.read(drained_) > 0) {
    }
    return part;
  }

  Auralizer& auralizer() { return *auralizer_; }
  AuralizerStatistics statistics() { return auralizer_->statistics(); }
  std::uint64_t callbacks() const { return gate_->counters().callbacks; }
  double energy() const { return energy_; }  // of all frames played
  double time_s() const { return time_s_; }  // played so far

 private:
  static void fill(void* self, float* output, std::uint32_t frames, bool) noexcept {
    auto& device = *static_cast<SoundDevice*>(self);
    device.callback_.fill({output, frames * device.channels_});
  }

  const std::size_t channels_;
  const std::unique_ptr<Auralizer> auralizer_;
  SampleRing recorded_{1 << 17}, metered_{1 << 17};
  AudioCallback callback_;
  const std::shared_ptr<CallbackGate> gate_;
  DeviceFeed feed_;
  const double rate_hz_;
  double time_s_ = 0, energy_ = 0;
  const DeviceFeed::Clock::time_point start_ = DeviceFeed::Clock::now();
  std::vector<float> block_;
  std::array<float, 4096> drained_{};
};

}  // namespace clamor::testing
