// mixer.h: the audio thread's half: voices slide from keyframe to keyframe and add up.
//
// Time is a 64-bit count of frames; a voice reads its signal at that count less its delay, which is
// kept in 32.32 fixed point: phase cannot drift, however long it plays. Mixing goes in steps of
// kStepFrames on a grid fixed to the clock, so a mix is a function of its keyframes alone.
//
// Where two keyframes meet, gains are within 1e-6 of each other and delays within 3e-7 frames: the
// rounding of 960 small steps.
//
// Threads: load(), hold() and step() are the audio thread's; begin() comes before them.
// Cost per step: about 4 cycles per voice and frame, 20 us per 64 frames and 1000 voices at 3 GHz.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/keyframe.h"
#include "runtime/mix_kernel.h"
#include "runtime/octave_bank.h"
#include "runtime/realtime.h"
#include "runtime/signal_bank.h"

namespace clamor {

class Mixer {
 public:
  // `signals` must outlive the mixer. Keyframes may use slots 0 to slots - 1.
  Mixer(std::span<const PreparedSignal> signals, std::size_t slots);

  // Everything sounds as `keyframe` says, and has for kBankTailFrames before `clock_frames`.
  void begin(const Keyframe& keyframe, std::int64_t clock_frames);

  // True at the end of a segment: load() the next keyframe, or hold() for one step.
  bool wants_keyframe() const noexcept REALTIME { return frame_ == kKeyframeFrames; }
  void load(const Keyframe& keyframe) noexcept REALTIME;
  void hold() noexcept REALTIME;

  // Mixes the next kStepFrames frames into interleaved (left, right), overwriting it.
  void step(float* interleaved) noexcept REALTIME;

  std::int64_t clock_frames() const { return clock_; }

  // Voices silenced because a gain or delay was not finite, or a delay slid beyond real time.
  std::uint64_t bad_voices() const noexcept REALTIME { return bad_voices_; }

 private:
  // 32.32 fixed point, frames.
  struct Delay {
    std::int64_t now = 0, slope = 0, target = 0;
  };
  struct Slot {
    const PreparedSignal* signal = nullptr;
    std::array<Delay, kEars> delay;
    std::array<float, kBusLanes> target{};
    bool audible = false;  // its gains were not all zero at the last keyframe
  };

  void load_voice(const Voice& voice) noexcept REALTIME;

  std::span<const PreparedSignal> signals_;
  std::vector<Slot> slots_;
  std::vector<KernelVoice> voices_;    // by slot
  std::vector<std::uint32_t> active_;  // slots that sound in this segment, in the keyframe's order
  OctaveBank bank_;
  std::int64_t clock_ = 0;
  int frame_ = 0;         // of the segment
  bool holding_ = false;  // slopes are zero until the next keyframe
  std::uint64_t bad_voices_ = 0;
};

}  // namespace clamor
