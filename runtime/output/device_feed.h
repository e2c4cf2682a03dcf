// device_feed.h: stands between a device's callbacks and the mixer.
//
// Devices come and go, and one that hangs may wake up long after another has taken its place, even
// after the player is gone. So no device calls the mixer itself. Each has a feed, all feeds share
// a gate, and the gate lets in one of them, the one the supervisor has given it to; a callback of
// any other gets silence. Whoever may still call back keeps its feed and the gate alive.
//
// A feed also turns the mixer's rate into the device's, watches that the device asks for neither
// too little nor too much (PulseAudio, when its server has died, calls back as fast as it can), and
// fades in when sound goes on somewhere in the middle.
//
// Threads: fill() on the device's; the rest on the supervisor's or, where it says so, on any.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/result.h"
#include "runtime/output/audio_output.h"
#include "runtime/output/resampler.h"
#include "runtime/realtime/callback_timing.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class CallbackGate {
 public:
  explicit CallbackGate(OutputCallback callback) : callback_(callback) {}

  // From now on only feed `id` (0: none) reaches the mixer. Waits for a block that is being mixed.
  void give_to(std::uint32_t id);

  // For feeds. enter() takes the mixer where it may, and is then followed by leave().
  bool enter(std::uint32_t id) noexcept REALTIME;
  void leave(std::uint32_t id) noexcept REALTIME;
  const OutputCallback& callback() const noexcept REALTIME { return callback_; }
  CallbackTiming& timing() noexcept REALTIME { return timing_; }

  CallbackTiming::Counters counters() const { return timing_.counters(); }  // on any thread

 private:
  static constexpr std::uint64_t kBusy = 1;
  static constexpr std::uint64_t open_to(std::uint32_t id) { return std::uint64_t{id} << 1; }

  const OutputCallback callback_;
  CallbackTiming timing_;                // whoever is inside has it
  std::atomic<std::uint64_t> state_{0};  // who may enter, | kBusy while inside
};

class DeviceFeed {
 public:
  using Clock = CallbackTiming::Clock;

  DeviceFeed(std::shared_ptr<CallbackGate> gate, std::uint32_t id, int channels)
      : gate_(std::move(gate)), id_(id), channels_(static_cast<std::size_t>(channels)) {}

  // What its device is to call. It must not call before prepare() nor after the feed is gone.
  OutputCallback callback() { return {&DeviceFeed::fill, this}; }

  Result<void> prepare(int rate_hz, int block_frames);

  // The first 10 ms of sound, because it does not begin there. Before the gate is given to it.
  void fade_in();

  void fill_at(Clock::time_point now, float* output, std::uint32_t frames,
               bool underflow) noexcept REALTIME;

  std::uint32_t id() const { return id_; }

  // On any thread.
  std::uint64_t callbacks() const { return callbacks_.load(std::memory_order_relaxed); }
  std::uint32_t block_frames() const { return block_frames_.load(std::memory_order_relaxed); }
  bool ran_away() const { return ran_away_.load(std::memory_order_relaxed); }
  bool resamples() const { return resampler_ != nullptr; }

 private:
  static void fill(void* self, float* output, std::uint32_t frames, bool underflow) noexcept;
  bool paced(Clock::time_point now, std::uint32_t frames) noexcept REALTIME;
  void mix(std::span<float> interleaved, bool underflow) noexcept REALTIME;
  void fade(std::span<float> interleaved) noexcept REALTIME;

  const std::shared_ptr<CallbackGate> gate_;
  const std::uint32_t id_;
  const std::size_t channels_;
  double rate_hz_ = 0;
  std::unique_ptr<Resampler> resampler_;  // null where the rates are the same

  // The device's thread.
  std::size_t fade_frames_ = 0, faded_frames_ = 0;
  Clock::time_point last_{};
  double credit_s_ = 0;  // sound that the device may still ask for ahead of time
  double longest_block_s_ = 0;

  std::atomic<std::uint64_t> callbacks_{0};
  std::atomic<std::uint32_t> block_frames_{0};
  std::atomic<bool> ran_away_{false};
};

}  // namespace clamor
