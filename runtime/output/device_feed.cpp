#include "runtime/output/device_feed.h"

#include <algorithm>
#include <span>
#include <thread>

#include "common/sample_rate.h"
#include "runtime/realtime/flush_denormals.h"
#include "runtime/realtime/prefault_stack.h"

namespace clamor {

namespace {

constexpr double kFade_s = 0.01;

// Limits on how far ahead of real time a device may ask for sound: it fills its buffers first and
// catches up after a delay. Its clock may run slightly faster than ours.
constexpr double kCredit_s = 0.25, kCreditBlocks = 16, kFastest = 1.02;

}  // namespace

void CallbackGate::give_to(std::uint32_t id) {
  for (;;) {
    std::uint64_t before = state_.load(std::memory_order_relaxed) & ~kBusy;
    // Take the gate while timing_ is modified.
    if (state_.compare_exchange_weak(before, kBusy, std::memory_order_acquire)) break;
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  timing_.restart();
  state_.store(open_to(id), std::memory_order_release);
}

bool CallbackGate::enter(std::uint32_t id) noexcept {
  std::uint64_t expected = open_to(id);
  return state_.compare_exchange_strong(expected, expected | kBusy, std::memory_order_acquire,
                                        std::memory_order_relaxed);
}

void CallbackGate::leave(std::uint32_t id) noexcept {
  state_.store(open_to(id), std::memory_order_release);
}

void DeviceFeed::fade_in() { fade_frames_ = static_cast<std::size_t>(kFade_s * rate_hz_); }

Result<void> DeviceFeed::prepare(int rate_hz, int block_frames) {
  rate_hz_ = rate_hz;
  block_frames_ = static_cast<std::uint32_t>(block_frames);
  pace_.restart(static_cast<double>(block_frames) / rate_hz);
  if (rate_hz == kSampleRate_hz) return {};
  auto resampler = Resampler::create(static_cast<int>(channels_), kSampleRate_hz, rate_hz);
  if (!resampler.ok()) return resampler.error();
  resampler_ = std::move(*resampler);
  return {};
}

void DeviceFeed::fill(void* self, float* output, std::uint32_t frames, bool underflow) noexcept {
  static_cast<DeviceFeed*>(self)->fill_at(Clock::now(), output, frames, underflow);
}

void DeviceFeed::fill_at(Clock::time_point now, float* output, std::uint32_t frames,
                         bool underflow) noexcept {
  const FlushDenormals no_denormals;
  prefault_stack();
  const std::span<float> interleaved(output, frames * channels_);
  callbacks_.store(callbacks_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  block_frames_.store(frames, std::memory_order_relaxed);
  if (frames == 0) return;
  if (!pace_.allows(now, frames / rate_hz_) || !gate_->enter(id_)) {
    std::fill(interleaved.begin(), interleaved.end(), 0.0f);
    return;
  }
  gate_->timing().begin(now, frames / rate_hz_, underflow);
  mix(interleaved, underflow);
  fade(interleaved);
  gate_->timing().end();
  gate_->leave(id_);
}

void DeviceFeed::PaceLimit::restart(double block_s) {
  longest_block_s_ = block_s;
  credit_s_ = max_credit_s();
}

double DeviceFeed::PaceLimit::max_credit_s() const noexcept {
  return kCredit_s + kCreditBlocks * longest_block_s_;
}

bool DeviceFeed::PaceLimit::allows(Clock::time_point now, double block_s) noexcept {
  if (block_s > longest_block_s_) {
    credit_s_ += kCreditBlocks * (block_s - longest_block_s_);
    longest_block_s_ = block_s;
  }
  if (last_ != Clock::time_point{})
    credit_s_ += kFastest * std::chrono::duration<double>(now - last_).count();
  last_ = now;
  credit_s_ = std::min(credit_s_, max_credit_s()) - block_s;
  if (credit_s_ < 0) exceeded_.store(true, std::memory_order_relaxed);
  return !is_exceeded();
}

void DeviceFeed::mix(std::span<float> interleaved, bool underflow) noexcept {
  const OutputCallback& callback = gate_->callback();
  if (resampler_ == nullptr) {
    const std::size_t frames = interleaved.size() / channels_;
    callback.fill(callback.context, interleaved.data(), static_cast<std::uint32_t>(frames),
                  underflow);
    return;
  }
  const auto fill = [](void* self, std::span<float> samples) noexcept {
    const auto& feed = *static_cast<DeviceFeed*>(self);
    const OutputCallback& mixer = feed.gate_->callback();
    mixer.fill(mixer.context, samples.data(),
               static_cast<std::uint32_t>(samples.size() / feed.channels_), false);
  };
  resampler_->read(interleaved, {fill, this});
}

void DeviceFeed::fade(std::span<float> interleaved) noexcept {
  for (std::size_t i = 0; i < interleaved.size() && faded_frames_ < fade_frames_; i += channels_) {
    const float gain = static_cast<float>(faded_frames_++) / static_cast<float>(fade_frames_);
    for (std::size_t c = 0; c < channels_; ++c) interleaved[i + c] *= gain;
  }
}

}  // namespace clamor
