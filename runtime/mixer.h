// mixer.h: the audio thread's half: voices slide from keyframe to keyframe and add up.
//
// Time is a 64-bit count of frames; a voice reads its signal at that count less its delay, which is
// kept in 32.32 fixed point: phase cannot drift, however long it plays. Mixing goes in steps of
// kStepFrames on a grid fixed to the clock, several at once where that is asked for, and a mix is a
// function of its keyframes alone.
//
// Where two keyframes meet, gains are within 1e-6 of each other and delays within 3e-7 frames: the
// rounding of 960 small steps. Their slopes turn there by what the keyframes say: straight lines
// have no less. With eight bands, gains and delays are those of kBankDelayFrames (0.5 ms) before.
//
// Threads: load(), hold(), mix() and step() are the audio thread's; begin() comes before them.
// Cost: tests/benchmarks/mixer_benchmark.cpp.
#pragma once

#include <algorithm>
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
  // `signals`, prepared for the same mode, must outlive the mixer. Keyframes may use slots 0 to
  // slots - 1.
  Mixer(std::span<const PreparedSignal> signals, std::size_t slots, const MixMode& mode = {});

  // Everything sounds as `keyframe` says, and has for kBankTailFrames before `clock_frames`.
  void begin(const Keyframe& keyframe, std::int64_t clock_frames);

  // True at the end of a segment: load() the next keyframe, or hold() for one step.
  bool wants_keyframe() const noexcept REALTIME { return frame_ == kKeyframeFrames; }
  void load(const Keyframe& keyframe) noexcept REALTIME;
  void hold() noexcept REALTIME;

  // Steps that one mix() may take now.
  int steps_left() const noexcept REALTIME {
    return std::min(kMostSteps, (kKeyframeFrames - frame_) / kStepFrames);
  }

  // Mixes the next so many steps into interleaved (left, right), overwriting it.
  void mix(float* interleaved, int steps) noexcept REALTIME;
  void step(float* interleaved) noexcept REALTIME { mix(interleaved, 1); }

  std::int64_t clock_frames() const { return clock_; }

  // Voices silenced because a gain or delay was not finite or beyond all measure, or a delay slid
  // beyond real time.
  std::uint64_t bad_voices() const noexcept REALTIME { return bad_voices_; }

 private:
  struct Slot {
    const PreparedSignal* signal = nullptr;
    // 32.32 fixed point: the delay at the end of the segment; where it is read next, if it plays
    // once.
    std::array<std::int64_t, kEars> delay{}, position{};
    bool audible = false;  // its gains were not all zero at the last keyframe
  };

  void load_voice(const Voice& voice) noexcept REALTIME;
  void place(std::uint32_t slot, int ear, std::int64_t delay, std::int64_t slope) noexcept REALTIME;
  void activate(std::uint32_t slot) noexcept REALTIME;
  void advance(int frames) noexcept REALTIME;
  void set_targets(const Voice& voice, bool usable, float* targets) const noexcept REALTIME;

  std::span<const PreparedSignal> signals_;
  const MixMode mode_;
  const int lanes_;
  const int lead_frames_;  // by which reading is ahead of what comes out
  std::array<std::array<float, kBandCount>, kBandCount> bus_gains_;

  // By slot.
  std::vector<Slot> slots_;
  std::vector<float> targets_;  // [lanes_]: gains at the end of the segment
  std::vector<float> gains_;    // MixJob
  std::vector<VoicePath> paths_;
  std::vector<std::int64_t> wraps_;  // where its signal comes round, 32.32; or never

  std::vector<std::uint32_t> active_;  // slots that sound in this segment, in the keyframe's order
  std::vector<std::uint32_t> once_;    // those of them whose signals play once
  MixBuses buses_;
  OctaveBank bank_;
  std::int64_t clock_ = 0;
  int frame_ = 0;         // of the segment
  bool holding_ = false;  // slopes are zero until the next keyframe
  std::uint64_t bad_voices_ = 0;
};

}  // namespace clamor
