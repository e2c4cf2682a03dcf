#include "runtime/mixer.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "runtime/flush_denormals.h"

namespace clamor {

namespace {

constexpr double kFixedOne = 4294967296.0;  // 2^32
constexpr double kLongestDelay_frames = 1 << 30;

static_assert(kKeyframeFrames % kStepFrames == 0 && kBankTailFrames % kStepFrames == 0);

bool is_usable(double delay_frames) {
  return std::abs(delay_frames) < kLongestDelay_frames;  // false for NaN
}

bool is_usable(const Voice& voice) {
  for (int e = 0; e < kEars; ++e) {
    if (!is_usable(voice.delay_frames[e])) return false;
    if (voice.starts && !is_usable(voice.start_delay_frames[e])) return false;
    float sum = 0;
    for (const float gain : voice.gain[e]) sum += gain * 0.0f;  // NaN unless all are finite
    if (sum != 0) return false;
  }
  return true;
}

std::int64_t fixed(double frames) { return std::llrint(frames * kFixedOne); }

}  // namespace

Mixer::Mixer(std::span<const PreparedSignal> signals, std::size_t slots)
    : signals_(signals), slots_(slots), voices_(slots) {
  active_.reserve(slots);
  for (KernelVoice& voice : voices_) voice = KernelVoice{};
}

void Mixer::begin(const Keyframe& keyframe, std::int64_t clock_frames) {
  for (const Voice& voice : keyframe.voices) {
    Voice started = voice;
    started.starts = true;
    started.start_delay_frames = started.delay_frames;
    load_voice(started);
  }
  active_.clear();
  for (const Voice& voice : keyframe.voices)
    if (slots_[voice.slot].audible) active_.push_back(voice.slot);
  frame_ = kKeyframeFrames;
  clock_ = clock_frames - kBankTailFrames;
  std::array<float, kEars * kStepFrames> unheard;
  while (clock_ < clock_frames) {
    hold();
    step(unheard.data());
  }
  frame_ = kKeyframeFrames;
}

void Mixer::load(const Keyframe& keyframe) noexcept REALTIME {
  active_.clear();
  for (const Voice& voice : keyframe.voices) {
    const bool sounded = !voice.starts && slots_[voice.slot].audible;
    load_voice(voice);
    if (sounded || slots_[voice.slot].audible) active_.push_back(voice.slot);
  }
  frame_ = 0;
  holding_ = false;
}

void Mixer::load_voice(const Voice& voice) noexcept REALTIME {
  assert(voice.slot < slots_.size() && voice.signal < signals_.size());
  Slot& slot = slots_[voice.slot];
  KernelVoice& kernel = voices_[voice.slot];
  slot.signal = &signals_[voice.signal];

  bool usable = is_usable(voice);
  std::array<Delay, kEars> delay;
  for (int e = 0; e < kEars && usable; ++e) {
    delay[e].now = voice.starts ? fixed(voice.start_delay_frames[e]) : slot.delay[e].target;
    delay[e].target = fixed(voice.delay_frames[e]);
    delay[e].slope = (delay[e].target - delay[e].now) / kKeyframeFrames;
    usable = std::abs(delay[e].slope) < (std::int64_t{1} << 32);
  }
  if (!usable) {
    // Down to silence from where it was.
    ++bad_voices_;
    for (int e = 0; e < kEars; ++e) delay[e] = {slot.delay[e].target, 0, slot.delay[e].target};
  }
  slot.delay = delay;

  float loudest = 0;
  for (int e = 0; e < kEars; ++e)
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const int lane = bus_lane(b, e);
      const float from = voice.starts ? 0 : slot.target[lane];
      const float to = usable ? voice.gain[e][b] : 0;
      kernel.gain[lane] = from;
      kernel.slope[lane] = (to - from) / kKeyframeFrames;
      slot.target[lane] = to;
      loudest = std::max(loudest, std::abs(to));
    }
  slot.audible = loudest > 0;
}

void Mixer::hold() noexcept REALTIME {
  if (!holding_) {
    for (const std::uint32_t s : active_) {
      std::copy(slots_[s].target.begin(), slots_[s].target.end(), voices_[s].gain);
      std::fill(std::begin(voices_[s].slope), std::end(voices_[s].slope), 0.0f);
      for (Delay& delay : slots_[s].delay) delay = {delay.target, 0, delay.target};
    }
    holding_ = true;
  }
  frame_ = kKeyframeFrames - kStepFrames;
}

void Mixer::step(float* interleaved) noexcept REALTIME {
  const FlushDenormals no_denormals;
  for (const std::uint32_t s : active_)
    for (int e = 0; e < kEars; ++e) {
      // The frame read is clock - delay: whole part and fraction of the sum of both.
      const Delay& delay = slots_[s].delay[e];
      const std::int64_t minus_delay = -(delay.now + frame_ * delay.slope);
      voices_[s].signal[e] = slots_[s].signal->at(clock_ + (minus_delay >> 32));
      voices_[s].fraction[e] =
          static_cast<float>(static_cast<std::uint32_t>(minus_delay)) * 0x1p-32f;
      voices_[s].drift[e] = static_cast<float>(-delay.slope) * 0x1p-32f;
    }

  alignas(64) float bus[kStepFrames * kBusLanes] = {};
  mix_voices(voices_.data(), active_.data(), active_.size(), frame_, bus);
  bank_.process(bus, kStepFrames, interleaved);
  clock_ += kStepFrames;
  frame_ += kStepFrames;
}

}  // namespace clamor
