// prepared_signal.h: signals in the form that the mixer reads, at any delay.
//
// For eight bands a signal is split into the two layers of the octave filter bank. For cubic
// interpolation its samples become half the coefficients of the B-spline through them. Guard
// samples on both sides let one kernel call read without wrapping. Samples that are NaN or infinite
// become 0 and are counted.
//
// A signal of up to kMaxWholeSignal_frames is one piece. A longer one is prepared in pieces of 2.7
// s, each from a window of samples that reaches beyond the piece as far as the filters remember (to
// -150 dB). A piece therefore has the same bits whether it is prepared with all others or streamed
// (sound_loader.h). All pieces of a signal are contiguous in memory.
//
// A live signal (live_signal.h) is a ring of its newest kRing_frames, read like a loop. Its range
// of frames that may be read moves on as it is written.
//
// Threads: any may read resident pieces. One thread at a time may write a piece of a streamed
// signal that is not resident, or frames of a live signal outside the range that may be read.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/platform/reserved_memory.h"
#include "formats/bake_file/signal_section.h"
#include "formats/level/signal.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

struct SignalWeights;

inline constexpr std::uint64_t kMaxWholeSignal_frames = kMaxSingleBlock_frames;  // 20 s
inline constexpr std::size_t kPieceFrames = std::size_t{1} << 17;
inline constexpr std::int64_t kRing_frames = std::int64_t{1} << 17;  // 2.7 s

class PreparedSignal {
 public:
  PreparedSignal(const Signal& signal, const MixMode& mode);

  // A streamed signal. No piece is resident, and none can be until use_memory() provides
  // memory_bytes() bytes at an offset of whole pages.
  PreparedSignal(std::uint64_t frames, bool loop, const MixMode& mode,
                 const Bands& mean_square = {});
  // A live signal, silent so far. Frame 0 is the next.
  static PreparedSignal live(const MixMode& mode);

  std::size_t memory_bytes() const { return layout_.high_bytes + layout_.low_bytes; }
  void use_memory(std::shared_ptr<ReservedMemory> memory, std::size_t offset);

  // Sets `path` to read from `position` (32.32 fixed point, frames of the signal). A loop extends
  // forever in both directions; a signal that plays once is silent before and after.
  void place(std::int64_t position, VoicePath& path) const noexcept REALTIME {
    if (loops()) {
      if (position < 0 || position >= wrap()) {
        position %= wrap();
        if (position < 0) position += wrap();
      }
    } else if (position < -((layout_.front_frames + kReach) << 32) || position >= layout_.end_frames
                                                                                      << 32) {
      path.high = path.low = silence();
      path.position = 0;
      return;
    }
    path.position = position;
    path.high = buffer_.high;
    path.low = buffer_.low;
  }

  // A caller may also follow a loop by subtracting wrap() once it is reached. Short loops are
  // stored repeatedly, so none is shorter than what a call reads.
  bool loops() const noexcept REALTIME { return layout_.loop_frames > 0; }
  std::int64_t wrap() const noexcept REALTIME { return layout_.loop_frames << 32; }

  // An equivalent frame near the stored samples: some loops away, or just as far before the
  // beginning or after the end.
  std::int64_t near(std::int64_t frame) const noexcept REALTIME;

  // Copies the high layer as it is stored, from frame `first` on, and samples of the low layer at
  // every kLowRate-th frame from `first` on. All pieces between must be resident.
  void read_high(std::int64_t first, std::span<float> stored) const noexcept REALTIME;
  void read_low(std::int64_t first, std::span<float> samples) const noexcept REALTIME;

  const Bands& mean_square() const noexcept REALTIME { return mean_square_; }
  std::uint64_t bad_samples() const { return bad_samples_; }

  bool is_live() const noexcept REALTIME { return live_ != nullptr; }
  bool streams() const noexcept REALTIME { return resident_ != nullptr || live_ != nullptr; }
  std::size_t pieces() const noexcept REALTIME { return layout_.pieces; }

  // Calls visit(piece) for all pieces that a voice reads between two frames, until it returns
  // false. Returns whether all calls returned true.
  template <class Visit>
  bool for_pieces(std::int64_t from, std::int64_t to, const Visit& visit) const noexcept REALTIME {
    if (layout_.loop_frames == 0) return in_buffer(from, to, visit);
    if (to - from >= layout_.loop_frames) return in_buffer(0, layout_.loop_frames, visit);
    const std::int64_t wrapped = from % layout_.loop_frames,
                       first = wrapped < 0 ? wrapped + layout_.loop_frames : wrapped;
    const std::int64_t last = first + (to - from);
    if (last < layout_.loop_frames) return in_buffer(first, last, visit);
    return in_buffer(first, layout_.loop_frames, visit) &&
           in_buffer(0, last - layout_.loop_frames, visit);
  }

  // A piece in memory. Voices that play one that is leaving may read on, but sources are no longer
  // chosen for it (sound_residency.h).
  enum class Residency : std::uint8_t { kAbsent, kLeaving, kStaying };

  // Returns whether all pieces between two frames are resident. The audio thread may then read them
  // until its next SoundLoader::mark_quiescent().
  bool is_resident(std::int64_t from, std::int64_t to) const noexcept REALTIME {
    if (live_ != nullptr)
      return from - kReach >= live_->first.load(std::memory_order_seq_cst) &&
             to + kReach <= live_->end.load(std::memory_order_seq_cst);
    return for_pieces(from, to, [this](std::size_t piece) noexcept REALTIME {
      return resident_[piece].load(std::memory_order_seq_cst) != Residency::kAbsent;
    });
  }
  // Returns whether all pieces between two frames of a streamed signal are resident and stay.
  bool stays_resident(std::int64_t from, std::int64_t to) const {
    return for_pieces(from, to, [this](std::size_t piece) {
      return resident_[piece].load(std::memory_order_relaxed) == Residency::kStaying;
    });
  }
  void set_residency(std::size_t piece, Residency residency) {
    resident_[piece].store(residency, std::memory_order_seq_cst);
  }

  // The range of samples that a piece is made from. Samples beyond the ends are silence, or the
  // loop.
  struct Window {
    std::int64_t first = 0;
    std::size_t frames = 0;
  };
  Window window(std::size_t piece) const;
  std::uint64_t frames() const { return frames_; }  // of the stored signal

  // Prepares a piece from the samples in its window. commit() must come before.
  void make(std::size_t piece, std::vector<double> samples);

  // Prepares `frames` frames of a live signal from `first` on; both are multiples of kLowRate. The
  // window holds kLiveWindow_frames more samples at either end. While it works, none of those
  // frames may be in the range that may be read.
  void make_live(std::int64_t first, std::size_t frames, std::vector<double> window);
  // Sets which frames of a live signal may be read.
  void set_live_range(std::int64_t first, std::int64_t end) {
    live_->first.store(first, std::memory_order_seq_cst);
    live_->end.store(end, std::memory_order_seq_cst);
  }
  // How far the layer split and the spline look ahead and back.
  static constexpr std::size_t kLiveWindow_frames = 1280;

  // Size of a piece's memory, and calls to fault it in (returns whether it is locked) and to
  // release it.
  std::size_t piece_bytes(std::size_t piece) const;
  bool commit(std::size_t piece);
  void decommit(std::size_t piece);

 private:
  // Bound on how far one kernel call reads: twice as many frames as it mixes, plus some vectors.
  static constexpr int kReach = 2 * kMaxFrames + 64;
  static constexpr int kGuardFrames = 1024;
  static_assert(kGuardFrames >= kReach + 16 && kGuardFrames % kLowRate == 0);
  static const float* silence() noexcept REALTIME;

  // A range of a piece's memory, in bytes from the beginning of the signal.
  struct Stretch {
    std::size_t first = 0, bytes = 0;
  };
  std::array<Stretch, 2> stretches(std::size_t piece) const;
  std::int64_t buffer_front() const noexcept REALTIME {
    return kGuardFrames + layout_.front_frames;
  }
  void make_whole(std::vector<double> samples);
  void make_part(std::size_t piece, std::vector<double> window);

  // for_pieces() for frames in the buffer, including the guards that a call may read.
  template <class Visit>
  bool in_buffer(std::int64_t from, std::int64_t to, const Visit& visit) const noexcept REALTIME {
    from += buffer_front() - kGuardFrames;
    to += buffer_front() + kGuardFrames;
    if (to < 0 || from >= layout_.buffer_frames) return true;
    const std::int64_t per_piece =
        layout_.pieces == 1 ? layout_.buffer_frames : std::int64_t{kPieceFrames};
    const std::int64_t last = std::min(to, layout_.buffer_frames - 1) / per_piece;
    for (std::int64_t p = std::max<std::int64_t>(from, 0) / per_piece; p <= last; ++p)
      if (!visit(static_cast<std::size_t>(p))) return false;
    return true;
  }

  // Layout of the prepared samples in memory.
  struct Layout {
    std::int64_t loop_frames = 0;  // a multiple of the loop's length; 0: plays once
    // Frames before frame 0 that may sound, and the end of the sound.
    std::int64_t front_frames = 0, end_frames = 0;
    std::int64_t buffer_frames = 0;  // total, including guards
    std::size_t pieces = 1;
    std::size_t high_bytes = 0, low_bytes = 0;  // whole pages
  };
  // The memory itself.
  struct Buffer {
    std::shared_ptr<ReservedMemory> memory;
    std::size_t offset = 0;
    float* high = nullptr;  // at frame 0
    float* low = nullptr;
  };

  MixMode mode_;
  std::uint64_t frames_ = 0;
  Layout layout_;
  Buffer buffer_;
  // By piece; null unless the signal is streamed.
  std::unique_ptr<std::atomic<Residency>[]> resident_;
  Bands mean_square_{};
  std::uint64_t bad_samples_ = 0;

  // The frames of a live signal that may be read.
  struct LiveRange {
    std::atomic<std::int64_t> first{0}, end{0};
  };
  std::unique_ptr<LiveRange> live_;  // null otherwise
};

std::vector<PreparedSignal> prepare_signals(std::span<const Signal> signals,
                                            const MixMode& mode = {});

// Weights of signals by their mean level, as strategies with a list use them.
SignalWeights mean_weights(std::span<const PreparedSignal> signals);

}  // namespace clamor
