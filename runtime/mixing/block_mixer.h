// block_mixer.h: the audio thread's half of an auralizer: blocks of any size, from keyframes.
//
// The mixer takes steps on a grid of its own; a block takes what is left of the last steps, and
// then as many more as it needs. The output gain and the limiter come after the mix. A keyframe
// that is due and not here is held for, and counted. With `adapt`, the time that blocks take tells
// how many voices may sound (load_control.h).
//
// What is heard at a time is of the keyframe of that time, whatever lies on its way: the bands of a
// head take 16 ms, the limiter 1.5. The mixer is that far ahead, from the start: keyframes come
// through a bounded queue, but the first two go to it without queueing, and what comes out before
// time 0 is dropped; from then on it is the audio thread's.
//
// Keyframes are made a few ahead, or, for a listener who is moved by hand, so late that they come
// just in time, one ahead. With `turns`, face() is heard without a new keyframe.
//
// Threads: wants_keyframe(), writable() and publish() are the sampler's, face() one other's, mix()
// the audio thread's, the rest any one's.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/mixing/head_rotation.h"
#include "runtime/mixing/limiter.h"
#include "runtime/mixing/load_control.h"
#include "runtime/mixing/mixer.h"
#include "runtime/mixing/output_format.h"
#include "runtime/realtime/latest_value.h"
#include "runtime/realtime/realtime.h"
#include "runtime/streaming/sound_loader.h"
#include "runtime/voices/keyframe_queue.h"

namespace clamor {

inline constexpr int kLargestBlock_frames = 1 << 16;

// How far ahead keyframes are made for blocks of so many frames.
std::size_t keyframes_ahead(int block_frames) noexcept REALTIME;

// The same for the largest blocks that there is room for, though they were not expected.
std::size_t max_keyframes_ahead(int block_frames);

struct BlockOptions {
  float gain = 1;
  bool limit = false;
  bool adapt = false;
  int block_frames = 960;  // the largest expected
  LoadClock clock{};
  const HeadRotation* turns = nullptr;  // must outlive it; null: turns come with keyframes
};

struct BlockStatistics {
  std::uint64_t held_blocks = 0, clipped_frames = 0, bad_voices = 0, late_voices = 0;
  std::uint32_t shed_voices = 0, max_shed_voices = 0;
  std::uint64_t shedding_blocks = 0;
  Limiter::Work limited{};
  std::array<float, kMaxChannels> peak{};  // since they were last asked for
};

class BlockMixer {
 public:
  // `signals`, and `sounds`, `panner` and `head` where they are not null, must outlive it.
  BlockMixer(std::span<const PreparedSignal> signals, std::size_t slots, const MixMode& mode,
             const Panner* panner, const Hrtf* head, SoundLoader* sounds,
             const BlockOptions& options);

  std::size_t channels() const noexcept REALTIME { return channels_; }

  // `lead_s`: so long before a keyframe is due it is wanted; by default as many ahead as there may
  // be.
  bool wants_keyframe(double lead_s = kAllAhead_s) const;
  static constexpr double kAllAhead_s = 1e9;
  std::uint64_t held_blocks() const { return held_blocks_.load(std::memory_order_relaxed); }
  Keyframe* writable() { return queue_.writable(); }  // null if none is free
  void publish(const Keyframe& written);

  void face(const ListenerAxes& facing) { facing_.publish(facing); }

  // Costs so much for each frame of each voice, and for each voice of each keyframe that begins;
  // what is mixed is whole steps, the last of which may be for the next call.
  void mix(std::span<float> interleaved) noexcept REALTIME;
  Mixer::Work work() const noexcept REALTIME { return mixer_.work(); }  // the audio thread's

  // How long it has held for keyframes that were due, in all: so much later than planned all others
  // come.
  std::uint64_t held_frames() const { return held_frames_.load(std::memory_order_relaxed); }

  // Of the newest keyframe's voices: the share that is left out now; and no more are taken.
  double shed_share() const;
  bool is_full() const { return mixer_is_full_.load(std::memory_order_relaxed); }

  BlockStatistics statistics();

 private:
  void expect(std::size_t frames) noexcept REALTIME;
  bool mix_more(std::size_t samples) noexcept REALTIME;
  void tell_load(double took_s, std::size_t frames, std::size_t sounding) noexcept REALTIME;
  void mix_lead();
  void mix_steps(int steps) noexcept REALTIME;
  void finish_mix() noexcept REALTIME;

  const std::size_t channels_;
  const float gain_;
  const bool adapting_;
  const LoadClock clock_;
  SoundLoader* const sounds_;
  std::atomic<std::size_t> ahead_;   // keyframes that may wait for the mixer
  std::atomic<int> block_frames_;    // the largest, so far or expected
  std::atomic<int> frames_left_{0};  // until the mixer wants the next keyframe
  LatestValue<ListenerAxes> facing_;
  const bool turns_;
  KeyframeQueue queue_;
  std::atomic<bool> begun_{false};  // the mixer is the audio thread's
  std::uint8_t published_ = 0;      // the sampler's: keyframes, up to the first two

  // Audio thread, once begun.
  Mixer mixer_;
  std::size_t largest_block_frames_ = 0;
  MixerLoadControl load_;
  const std::unique_ptr<Limiter> limiter_;  // or null
  const int lead_frames_;                   // by which the mixer's clock is ahead of what goes out
  std::vector<float> mixed_;
  std::size_t mixed_end_ = 0, mixed_read_ = 0;  // samples in it, and those already given away

  // Statistics.
  std::atomic<std::uint64_t> held_blocks_{0}, held_frames_{0}, clipped_frames_{0}, bad_voices_{0},
      late_voices_{0};
  std::atomic<std::uint32_t> loaded_{0}, shed_{0}, max_shed_voices_{0};  // of the mixer's voices
  std::atomic<bool> mixer_is_full_{false};
  std::atomic<std::uint64_t> shedding_blocks_{0};
  std::array<std::atomic<float>, kMaxChannels> peak_{};
};

}  // namespace clamor
