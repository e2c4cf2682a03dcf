// block_mixer.h: the audio thread's half of an auralizer: turns keyframes into blocks of any size.
//
// The mixer works in steps on a fixed grid. A block takes the rest of the last steps, then as many
// more as it needs. Output gain and limiter come after the mix. If a due keyframe is missing, the
// mixer holds the last one and counts that. With `adapt`, the measured load limits the number of
// voices (load_control.h). Load is measured over a period of a keyframe or more, because any single
// block may have been interrupted by another program. The audio thread measures the time that
// passes. Reading its CPU time is a system call, so the sampler's thread does that in publish(),
// and tells what share of the time that passed was the audio thread's own.
//
// Latency compensation: output at a given time belongs to the keyframe of that time, although HRTF
// filters delay it by 16 ms and the limiter by 1.5 ms. The mixer runs ahead by that much from the
// start. The sampler therefore gives it the first two keyframes directly, and output before time 0
// is dropped; from then on the mixer belongs to the audio thread and keyframes come through a
// bounded queue.
//
// Keyframes are made a few ahead or, for a listener who moves in real time, as late as possible.
// With `turns`, turn_head() takes effect without a new keyframe.
//
// Threads: wants_keyframe(), writable() and publish() run on the sampler's thread, turn_head() on
// one other, mix() on the audio thread, the rest on any one.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <ctime>
#include <memory>
#include <span>
#include <vector>

#include "runtime/mixing/block_statistics.h"
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

// Returns keyframes_ahead() for the largest unannounced blocks that there is room for.
std::size_t max_keyframes_ahead(int block_frames);

struct BlockOptions {
  float gain = 1;
  bool limit = false;
  bool adapt = false;
  int block_frames = 960;  // the largest expected
  LoadClock clock{};
  // Must outlive the mixer; null: rotations come with keyframes.
  const HeadRotation* turns = nullptr;
};

class BlockMixer {
 public:
  // The spans of `signals`, and `sounds`, `panner` and `head` if not null, must outlive this.
  BlockMixer(PlayableSignals signals, std::size_t slots, const MixMode& mode, const Panner* panner,
             const Hrtf* head, SoundLoader* sounds, const BlockOptions& options);

  std::size_t channels() const noexcept REALTIME {
    return static_cast<std::size_t>(mixer_.channels());
  }

  // A keyframe is wanted `lead_s` before it is due and, unless the listener moves in real time, as
  // long as fewer than keyframes_ahead() are ready.
  bool wants_keyframe(double lead_s = 0, bool in_real_time = false) const;
  std::uint64_t held_blocks() const {
    return counters_.held_blocks.load(std::memory_order_relaxed);
  }
  // Before the first keyframe: leaves out so many frames of the output, as if the mixer had held
  // for as long before it.
  void skip(std::uint64_t frames);

  Keyframe* writable() { return queue_.writable(); }     // null if none is free
  std::size_t waiting() const { return queue_.size(); }  // keyframes that the mixer has not loaded
  void publish(const Keyframe& written);

  void turn_head(const ListenerAxes& axes) { axes_.publish(axes); }

  // Costs time per frame of each voice and per voice of each new keyframe. Whole steps are mixed,
  // so the last step may partly belong to the next call.
  void mix(std::span<float> interleaved) noexcept REALTIME;
  Mixer::Work work() const noexcept REALTIME { return mixer_.work(); }  // audio thread

  // Total time held for missing keyframes, or skipped, by which all later keyframes are delayed.
  std::uint64_t held_frames() const {
    return counters_.held_frames.load(std::memory_order_relaxed);
  }

  // The share of the newest keyframe's voices that is shed now, and whether there is no time for
  // more.
  double shed_share() const;
  bool is_full() const { return counters_.mixer_is_full.load(std::memory_order_relaxed); }
  // The share of its time that the audio thread waits for a core. Sampler's thread.
  double waiting_share() const { return audio_thread_.waiting_share(); }

  BlockStatistics statistics();

 private:
  // Returns how many keyframes must wait for the mixer: enough for a block as large as the largest
  // so far. The audio thread writes, the sampler's reads.
  class KeyframeDemand {
   public:
    explicit KeyframeDemand(int block_frames);

    bool wants_another(std::size_t waiting, double lead_s, bool in_real_time) const;
    void expect(std::size_t block_frames) noexcept REALTIME;
    void set_frames_left(int frames) noexcept REALTIME {
      frames_left_.store(frames, std::memory_order_relaxed);
    }

   private:
    const std::size_t most_;                // keyframes that there is room for
    std::atomic<std::size_t> ahead_;        // keyframes that are ready unless the listener moves
    std::atomic<int> block_frames_;         // the largest so far or expected
    std::atomic<int> frames_left_{0};       // until the mixer wants the next keyframe
    std::size_t largest_block_frames_ = 0;  // so far; the audio thread's alone
  };

  // Steps that are mixed, and how much of them was output.
  struct MixedSteps {
    std::vector<float> samples;
    std::size_t end = 0, read = 0;

    bool is_empty() const noexcept REALTIME { return read == end; }
    // Outputs as many samples as there are and fit. Returns their number.
    std::size_t take(std::span<float> output) noexcept REALTIME;
  };

  struct Counters {
    std::atomic<std::uint64_t> held_blocks{0}, held_frames{0}, clipped_frames{0}, bad_voices{0},
        late_voices{0};
    std::atomic<std::uint32_t> loaded{0}, shed{0}, max_shed_voices{0};  // of the mixer's voices
    std::atomic<bool> mixer_is_full{false};
    std::atomic<double> mixing_s{0};        // in all, as time passed
    std::atomic<clockid_t> audio_thread{};  // the CPU clock of the thread that mixes
    std::atomic<double> own_share{1};       // of the time that passes while it mixes
    std::atomic<std::uint64_t> shedding_blocks{0};
    std::array<std::atomic<float>, kMaxChannels> peak{};
  };

  // The audio thread as the sampler's thread sees it: the share of the time that passes while it
  // mixes that is its own. Recent times count most.
  class AudioThread {
   public:
    // Records what it has taken so far.
    void took(const WorkTime& so_far_s, clockid_t thread);
    double waiting_share() const;

   private:
    static constexpr double kForget = 0.96;  // per keyframe: halves in 0.3 s

    clockid_t thread_{};
    WorkTime so_far_s_, recent_s_;
  };

  // Voices and frames that were mixed since the last measurement.
  struct Measured {
    double took_s = 0;
    std::size_t frames = 0, sounding = 0;
  };

  bool mix_more(std::size_t samples) noexcept REALTIME;
  void meter_audio_thread();
  void tell_load(double took_s, std::size_t frames, std::size_t sounding) noexcept REALTIME;
  void mix_lead();
  void mix_steps(int steps) noexcept REALTIME;
  void finish_mix() noexcept REALTIME;

  const BlockOptions options_;
  SoundLoader* const sounds_;
  KeyframeDemand demand_;
  LatestValue<ListenerAxes> axes_;
  KeyframeQueue queue_;
  std::atomic<bool> begun_{false};  // the mixer belongs to the audio thread
  std::uint8_t published_ = 0;      // sampler's thread: keyframes, counted up to two
  AudioThread audio_thread_;        // sampler's thread

  // Used by the audio thread once begun_.
  Mixer mixer_;
  MixerLoadControl load_;
  Measured measured_;
  const std::unique_ptr<Limiter> limiter_;  // or null
  MixedSteps mixed_;

  Counters counters_;
};

}  // namespace clamor
