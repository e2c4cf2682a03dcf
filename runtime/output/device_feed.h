// device_feed.h: connects a device's callbacks to the mixer.
//
// A device that hangs may wake up long after another has taken its place, even after the player is
// gone. Devices therefore never call the mixer directly. Each device has a feed, all feeds share
// one gate, and the gate admits only the feed that the supervisor has chosen; callbacks of all
// other feeds get silence. A thread that may still call back keeps its feed and the gate alive.
//
// A feed also resamples to the device's rate, detects devices that ask for far too much (PulseAudio
// calls back in a busy loop when its server has died), and fades in when sound resumes in the
// middle.
//
// Threads: fill() runs on the device's thread, everything else on the supervisor's unless noted.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/result.h"
#include "runtime/output/audio_output.h"
#include "runtime/mixing/resampler.h"
#include "runtime/realtime/callback_timing.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class CallbackGate {
 public:
  explicit CallbackGate(OutputCallback callback) : callback_(callback) {}

  // Admits only feed `id` from now on (0: none). Waits for a block that is being mixed.
  void give_to(std::uint32_t id);

  // For feeds. If enter() returns true, leave() must follow.
  bool enter(std::uint32_t id) noexcept REALTIME;
  void leave(std::uint32_t id) noexcept REALTIME;
  const OutputCallback& callback() const noexcept REALTIME { return callback_; }
  CallbackTiming& timing() noexcept REALTIME { return timing_; }

  CallbackTiming::Counters counters() const { return timing_.counters(); }  // any thread

 private:
  static constexpr std::uint64_t kBusy = 1;
  static constexpr std::uint64_t open_to(std::uint32_t id) { return std::uint64_t{id} << 1; }

  const OutputCallback callback_;
  CallbackTiming timing_;                // used by whoever is inside the gate
  std::atomic<std::uint64_t> state_{0};  // the admitted feed, | kBusy while it is inside
};

class DeviceFeed {
 public:
  using Clock = CallbackTiming::Clock;

  DeviceFeed(std::shared_ptr<CallbackGate> gate, std::uint32_t id, int channels)
      : gate_(std::move(gate)), id_(id), channels_(static_cast<std::size_t>(channels)) {}

  // The callback for the device. It must not run before prepare() or after the feed is destroyed.
  OutputCallback callback() { return {&DeviceFeed::fill, this}; }

  Result<void> prepare(int rate_hz, int block_frames);

  // Fades the first 10 ms in, for sound that resumes in the middle. Call before the gate admits
  // this feed.
  void fade_in();

  void fill_at(Clock::time_point now, float* output, std::uint32_t frames,
               bool underflow) noexcept REALTIME;

  std::uint32_t id() const { return id_; }

  // Any thread.
  std::uint64_t callbacks() const { return callbacks_.load(std::memory_order_relaxed); }
  std::uint32_t block_frames() const { return block_frames_.load(std::memory_order_relaxed); }
  bool ran_away() const { return pace_.is_exceeded(); }
  bool resamples() const { return resampler_ != nullptr; }

 private:
  // A leaky bucket: credit accrues in real time, and a device that asks for far more than that is
  // broken.
  class PaceLimit {
   public:
    void restart(double block_s);
    // False once a device has asked for too much.
    bool allows(Clock::time_point now, double block_s) noexcept REALTIME;
    bool is_exceeded() const noexcept { return exceeded_.load(std::memory_order_relaxed); }

   private:
    double max_credit_s() const noexcept REALTIME;

    Clock::time_point last_{};
    double credit_s_ = 0;  // sound that the device may still ask for ahead of real time
    double longest_block_s_ = 0;
    std::atomic<bool> exceeded_{false};
  };

  static void fill(void* self, float* output, std::uint32_t frames, bool underflow) noexcept;
  void mix(std::span<float> interleaved, bool underflow) noexcept REALTIME;
  void fade(std::span<float> interleaved) noexcept REALTIME;

  const std::shared_ptr<CallbackGate> gate_;
  const std::uint32_t id_;
  const std::size_t channels_;
  double rate_hz_ = 0;
  std::unique_ptr<Resampler> resampler_;  // null if the rates are equal

  // Used by the device's thread.
  std::size_t fade_frames_ = 0, faded_frames_ = 0;
  PaceLimit pace_;

  std::atomic<std::uint64_t> callbacks_{0};
  std::atomic<std::uint32_t> block_frames_{0};
};

}  // namespace clamor
