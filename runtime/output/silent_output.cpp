// silent_output.cpp: an output without a device that keeps time in silence.
#include <atomic>
#include <chrono>
#include <thread>

#include "common/platform/thread.h"
#include "common/sample_rate.h"
#include "runtime/output/audio_output.h"

namespace clamor {

namespace {

constexpr auto kMaxBehind = std::chrono::milliseconds(100);

class SilentOutput final : public AudioOutput {
 public:
  SilentOutput(int channels, int block_frames, OutputCallback callback)
      : callback_(callback),
        frames_(block_frames),
        block_(static_cast<std::size_t>(channels) * static_cast<std::size_t>(block_frames)) {}
  ~SilentOutput() override { stop(); }

  Result<void> start() override {
    stop();
    running_ = true;
    thread_ = std::thread([this] { keep_time(); });
    return {};
  }

  void stop() override {
    running_ = false;
    if (thread_.joinable()) thread_.join();
  }

  std::string name() const override { return "none"; }
  int block_frames() const override { return frames_; }
  int rate_hz() const override { return kSampleRate_hz; }

 private:
  void keep_time() {
    using Clock = std::chrono::steady_clock;
    name_thread("audio clock");
    const auto period = std::chrono::nanoseconds(1'000'000'000LL * block_frames() / kSampleRate_hz);
    auto next = Clock::now();
    while (running_.load(std::memory_order_relaxed)) {
      callback_.fill(callback_.context, block_.data(), static_cast<std::uint32_t>(block_frames()),
                     false);
      next += period;
      // After a suspend of the machine, continue from now instead of catching up on the whole gap.
      if (const auto now = Clock::now(); now - next > kMaxBehind) next = now;
      std::this_thread::sleep_until(next);
    }
  }

  OutputCallback callback_;
  const int frames_;
  std::vector<float> block_;
  std::atomic<bool> running_{false};
  std::thread thread_;
};

}  // namespace

std::unique_ptr<AudioOutput> silent_output(int channels, int block_frames,
                                           OutputCallback callback) {
  return std::make_unique<SilentOutput>(channels, block_frames, callback);
}

}  // namespace clamor
