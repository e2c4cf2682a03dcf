// fake_devices.h: sound devices that misbehave as a test wants, and a mixer that checks its calls.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/sample_rate.h"
#include "runtime/output/audio_output.h"

namespace clamor::testing {

// The state of the only device. A test may change it at any time; it outlives all outputs.
struct FakeWorld {
  std::atomic<bool> is_there{true};  // is listed
  std::atomic<bool> opens{true};
  std::atomic<bool> asks{true};        // false: callbacks stop, as when it is unplugged
  std::atomic<bool> runs_away{false};  // calls back in a busy loop, as PulseAudio's client does
  std::atomic<bool> says_so{false};    // reports that it has failed
  std::atomic<bool> opening_hangs{false}, closing_hangs{false};
  std::atomic<int> rate_hz{kSampleRate_hz};
  std::function<std::uint32_t(std::uint64_t)> block_frames = [](std::uint64_t) { return 256u; };

  std::atomic<int> openings{0}, open_now{0}, stale_calls{0};
  std::atomic<bool> stale_sound{false};  // a closing device got sound instead of silence
  std::atomic<std::uint64_t> frames{0};  // requested by devices

  void keep(const std::vector<float>& block) {
    const std::lock_guard lock(mutex);
    heard.insert(heard.end(), block.begin(), block.end());
  }
  std::vector<float> taken() {
    const std::lock_guard lock(mutex);
    return std::move(heard);
  }

  std::mutex mutex;
  std::vector<float> heard;
};

template <class Condition>
bool comes_true(Condition condition,
                std::chrono::milliseconds patience = std::chrono::seconds(20)) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

class FakeOutput final : public AudioOutput {
 public:
  FakeOutput(std::shared_ptr<FakeWorld> world, int channels, OutputCallback callback)
      : world_(std::move(world)),
        channels_(static_cast<std::size_t>(channels)),
        callback_(callback),
        rate_hz_(world_->rate_hz) {
    ++world_->open_now;
  }
  ~FakeOutput() override {
    // A device that hangs calls back once more when it wakes up, even if everything else is gone by
    // then.
    while (world_->closing_hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    stop();
    if (called_) call(1, true);
    --world_->open_now;
  }

  Result<void> start() override {
    running_ = true;
    thread_ = std::thread([this] { run(); });
    return {};
  }
  void stop() override {
    running_ = false;
    if (thread_.joinable()) thread_.join();
  }
  std::string name() const override { return "fake: device"; }
  int block_frames() const override { return static_cast<int>(world_->block_frames(0)); }
  int rate_hz() const override { return rate_hz_; }
  std::string failure() const override { return world_->says_so ? "it was unplugged" : ""; }

 private:
  using Clock = std::chrono::steady_clock;

  void run() {
    auto next = Clock::now();
    for (std::uint64_t block = 0; running_; ++block) {
      const std::uint32_t frames = world_->block_frames(block);
      if (world_->asks) call(frames, false);
      if (world_->runs_away && world_->asks) continue;
      next += std::chrono::nanoseconds(1'000'000'000LL * frames / rate_hz_);
      std::this_thread::sleep_until(next);
    }
  }

  void call(std::uint32_t frames, bool stale) {
    block_.assign(frames * channels_, 9.0f);
    callback_.fill(callback_.context, block_.data(), frames, false);
    called_ = true;
    if (stale) {
      ++world_->stale_calls;
      for (const float sample : block_) world_->stale_sound = world_->stale_sound || sample != 0;
    } else {
      world_->frames += frames;
      world_->keep(block_);
    }
  }

  const std::shared_ptr<FakeWorld> world_;
  const std::size_t channels_;
  const OutputCallback callback_;
  const int rate_hz_;
  std::atomic<bool> running_{false};
  bool called_ = false;
  std::vector<float> block_;
  std::thread thread_;
};

class FakeDevices final : public OutputDriver {
 public:
  explicit FakeDevices(std::shared_ptr<FakeWorld> world) : world_(std::move(world)) {}

  std::vector<OutputDevice> devices(const std::string&) override {
    if (!world_->is_there) return {};
    return {{"fake", "device", 2, {static_cast<unsigned>(world_->rate_hz.load())}, true}};
  }
  Result<std::unique_ptr<AudioOutput>> open(const OutputDevice&, const OutputRequest& request,
                                            OutputCallback callback) override {
    ++world_->openings;
    while (world_->opening_hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (!world_->opens) return Error("the device is busy");
    return std::unique_ptr<AudioOutput>(
        std::make_unique<FakeOutput>(world_, request.channels, callback));
  }

 private:
  const std::shared_ptr<FakeWorld> world_;
};

// Writes the frame number on the left channel and -1 on the right. Must not be called by two
// threads.
class CountingMixer {
 public:
  OutputCallback callback() {
    return {[](void* self, float* output, std::uint32_t frames, bool) noexcept {
              static_cast<CountingMixer*>(self)->mix(output, frames);
            },
            this};
  }
  std::uint64_t frames() const { return frames_.load(); }
  bool was_called_by_two() const { return called_by_two_; }

 private:
  void mix(float* output, std::uint32_t frames) noexcept {
    if (inside_.exchange(true)) called_by_two_ = true;
    std::uint64_t frame = frames_.load();
    for (std::uint32_t i = 0; i < frames; ++i) {
      output[2 * i] = static_cast<float>(++frame % 1'000'000);
      output[2 * i + 1] = -1;
    }
    frames_ = frame;
    inside_ = false;
  }

  std::atomic<std::uint64_t> frames_{0};
  std::atomic<bool> inside_{false}, called_by_two_{false};
};

}  // namespace clamor::testing
