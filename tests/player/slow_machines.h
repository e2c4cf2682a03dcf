// slow_machines.h: simulated machines that are too slow for a player, by the clocks that it reads.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

#include "common/sample_rate.h"
#include "runtime/mixing/load_control.h"
#include "runtime/player/player.h"
#include "runtime/player/player_statistics.h"

namespace clamor::testing {

// A simulated machine on which a thread makes keyframes and mixes slower than the device plays.
class SlowThread {
 public:
  static constexpr std::uint64_t kBlock_frames = 256;

  LoadClock sampler_clock() {
    return {[](void* self) noexcept { return of(self).sampled(); }, this};
  }
  LoadClock audio_clock() {
    return {[](void* self) noexcept { return of(self).mixed(); }, this};
  }

  // The calling thread is slow from now on, while `player` plays.
  void begin(Player& player) {
    thread_ = std::this_thread::get_id();
    player_ = &player;
  }
  void end() { player_ = nullptr; }
  std::uint64_t mixed_frames() const { return clock_reads_ / 2 * kBlock_frames; }

 private:
  static SlowThread& of(void* self) { return *static_cast<SlowThread*>(self); }
  bool is_slow() const { return player_ != nullptr && std::this_thread::get_id() == thread_; }

  void let_play(std::uint64_t frames) const {
    const double until_s =
        player_.load()->statistics().time_s + static_cast<double>(frames) / kSampleRate_hz;
    while (player_.load()->statistics().time_s < until_s)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  // The first keyframes take so long that something must be mixed to catch up.
  double sampled() const {
    if (is_slow() && clock_reads_ == 0) let_play(10 * kBlock_frames);
    return 0;
  }
  // Read before and after each block.
  double mixed() {
    if (is_slow() && ++clock_reads_ % 2 == 0) let_play(kBlock_frames + kBlock_frames / 4);
    return 0;
  }

  std::thread::id thread_;
  std::atomic<Player*> player_{nullptr};
  std::uint64_t clock_reads_ = 0;  // of the slow thread, for mixing
};

// A simulated machine on which everything takes a given time.
struct Burden {
  std::atomic<double> takes_s{0};
  double now_s = 0;  // of the thread that reads the clock

  LoadClock clock() {
    return {[](void* context) noexcept {
              auto& self = *static_cast<Burden*>(context);
              return self.now_s += self.takes_s.load(std::memory_order_relaxed);
            },
            this};
  }
};

}  // namespace clamor::testing
