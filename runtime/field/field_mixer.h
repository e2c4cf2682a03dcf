// field_mixer.h: plays the responses of a field: a partitioned convolution of each signal, added to
// the buses of the voices.
//
// Blocks are partitions of a keyframe. While one is played, the next is computed, a share with each
// step, so that the load is even. The spectra of each input's newest blocks are kept; a block of
// output is the inverse transform of the sum of their products with a response's partitions. A
// window of a signal reaches a block and a margin ahead of the clock (overlap-save): stored signals
// are known ahead, so the field has no latency.
//
// What is new of a response fades in while what it replaces fades out; the rest stays. The weights
// w and 1 - w are right where both are alike. Their sum is to be divided by sqrt(w^2 + (1 - w)^2 +
// 2 rho w (1 - w)), rho being the correlation in a band. A filter that changes with each frame is
// not needed for that: each response's output and its output times `correction` share one
// transform, and only the sum of these four changes its weights.
//
// Output goes to all buses of a layer equally, which therefore only undo the phase that the signals
// were prepared with (octave_filter_bank.h).
//
// Threads: the audio thread's, but for the constructor and begin().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/field/field_response.h"
#include "runtime/hrtf/diffuse_hrtf_eq.h"
#include "runtime/realtime/realtime.h"
#include "runtime/streaming/playable_signals.h"
#include "runtime/voices/keyframe.h"
#include "runtime/voices/lane_fourier.h"

namespace clamor {

class FieldMixer {
 public:
  FieldMixer(PlayableSignals signals, int pairs);

  // Starts as if the responses had always been there, `played_frames` into a block. Frames of
  // signals that begin at 0 are read from `read_frame` on.
  void begin(const FieldUpdate& update, std::int64_t read_frame, int played_frames);
  // Fades to these responses from the next block on.
  void load(const FieldUpdate& update) noexcept REALTIME;

  // Adds the next frames (whole steps) of a pair of channels to all buses of the layers alike.
  void add_to(MixBuses& buses, std::size_t pair, int frames) const noexcept REALTIME;
  // Adds the power of the taps that sound.
  void add_powers(DiffuseHrtfEq& eq) const noexcept REALTIME;
  // Of the block that is played.
  int frames_left() const noexcept REALTIME { return kKeyframeFrames - played_frames_; }
  // These have been played: computes as large a share of the next block.
  void advance(int frames) noexcept REALTIME;

  // Blocks of inputs that were silent because they were not in memory.
  std::uint64_t late_blocks() const noexcept REALTIME { return late_blocks_; }

 private:
  static constexpr std::size_t kLanes = 4;
  // A step of the convolution, in multiplications of spectra that take as long.
  static constexpr std::size_t kWindowCost = 8, kOutputCost = 40;
  static constexpr std::size_t kProducts = 4;  // at once

  // Output of one part to a pair of channels in one block.
  struct Block {
    std::array<std::array<float, kHighField.partition>, kEars> high{};
    std::array<std::array<float, kLowField.partition>, kEars> low{};
    bool is_silent = true;
  };
  struct Pair {
    FieldSums sum_from{}, sum_to{}, sum_kept{};
    std::array<Block, 2> blocks;
  };
  // What fades out, what fades in, and what stays.
  using Roles = std::array<std::span<const FieldPartition>, 3>;
  struct Part {
    FieldResponse* from = nullptr;  // null unless one fades out
    FieldResponse* to = nullptr;
    FieldResponse* next = nullptr;  // to fade to when the current fade is over
    int faded_blocks = 0;
    std::vector<Pair> pairs;

    Roles partitions() const noexcept REALTIME;
  };
  // What is done of the next block.
  struct Progress {
    bool has_begun = false;
    bool lacks_windows = true;  // of inputs
    std::size_t cost = 0, done = 0;
    std::size_t part = 0, role = 0, partition = 0, pair = 0;  // role: of Part::partitions()
  };
  struct alignas(64) Work {
    std::array<float, kLanes * kHighField.transform> real, imaginary;
  };
  // A window that is to be transformed.
  struct Wanted {
    FieldInput* input;
    std::int64_t block;
  };

  void begin_block() noexcept REALTIME;
  void work_to(std::size_t cost) noexcept REALTIME;
  bool work_on() noexcept REALTIME;
  bool make_windows() noexcept REALTIME;
  void transform(const std::array<Wanted, kLanes>& wanted, std::size_t count) noexcept REALTIME;
  bool read(const Wanted& wanted, std::size_t lane) noexcept REALTIME;
  bool multiply_next() noexcept REALTIME;
  void multiply(std::span<const FieldPartition> some, std::span<Pair> pairs) noexcept REALTIME;
  void output(const Part& part, Pair& pair) noexcept REALTIME;
  void end_block() noexcept REALTIME;
  static void release(FieldResponse*& response) noexcept REALTIME {
    if (response != nullptr) response->is_free.store(true, std::memory_order_release);
    response = nullptr;
  }
  // Calls visit(input) for each input of the responses that sound.
  template <class Visit>
  void for_inputs(const Visit& visit) const noexcept REALTIME;

  const PlayableSignals signals_;
  const LaneFourier high_, low_;
  std::array<Part, kFieldParts> parts_{};
  std::size_t current_ = 0;       // of each part's blocks: the one that is played
  int played_frames_ = 0;         // of it
  std::int64_t block_ = 0;        // number of the next block
  std::int64_t first_frame_ = 0;  // read by block 0
  Progress progress_;
  std::vector<Work> work_;          // of the high layer and of the low one
  std::vector<FieldSums> spectra_;  // by lane
  std::vector<float> window_;
  std::uint64_t late_blocks_ = 0;
};

}  // namespace clamor
