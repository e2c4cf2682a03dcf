// prepared_signal.h: signals made ready to be read by voices at any delay.
//
// For eight bands a signal is parted into the octave bank's two layers; for cubic interpolation the
// samples of what is read become half the coefficients of the B-spline through them. There are
// guard samples on both sides, so that one call of the kernel never wraps while it reads. Samples
// that are NaN or infinite become 0 and are counted.
//
// A signal of up to kMaxWholeSignal_frames is one piece. A longer one is made in pieces of 2.7 s,
// each from the samples of its own window alone, which reaches as far beyond it as the filters
// remember (to -150 dB): so that a piece is the same bits whether it is made with the others, or
// when a player comes to it (sound_loader.h). All pieces lie side by side as if there were but one.
//
// Threads: any may read what is here. Of a signal that streams, one thread at a time may write a
// piece that is not here.
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
#include "formats/bake_file/signal_section.h"
#include "formats/level/signal.h"
#include "runtime/realtime/realtime.h"
#include "runtime/streaming/sound_memory.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

inline constexpr std::uint64_t kMaxWholeSignal_frames = kMaxSingleBlock_frames;  // 20 s
inline constexpr std::size_t kPieceFrames = std::size_t{1} << 17;

class PreparedSignal {
 public:
  PreparedSignal(const Signal& signal, const MixMode& mode);

  // One that streams: so far none of it is here, and so it stays until somebody gives it memory of
  // memory_bytes(), from an offset of whole pages on.
  PreparedSignal(std::uint64_t frames, bool loop, const MixMode& mode,
                 const Bands& mean_square = {});
  std::size_t memory_bytes() const { return high_bytes_ + low_bytes_; }
  void use_memory(std::shared_ptr<SoundMemory> memory, std::size_t offset);

  // Where a kernel call must read that starts at `position` (32.32, frames of the signal's own
  // time). A loop goes on for ever both ways; a signal that plays once is silent before and after.
  void place(std::int64_t position, VoicePath& path) const noexcept REALTIME {
    if (loops()) {
      if (position < 0 || position >= wrap()) {
        position %= wrap();
        if (position < 0) position += wrap();
      }
    } else if (position < -((front_frames_ + kReach) << 32) || position >= end_frames_ << 32) {
      path.high = path.low = silence();
      path.position = 0;
      return;
    }
    path.position = position;
    path.high = high_;
    path.low = low_;
  }

  // A loop may also be followed by subtracting wrap() once it is reached: none is shorter than what
  // a call may read, because short ones are repeated.
  bool loops() const noexcept REALTIME { return loop_frames_ > 0; }
  std::int64_t wrap() const noexcept REALTIME { return loop_frames_ << 32; }

  // The frame that is as good as any other so many loops away or so long before or after the end.
  std::int64_t near(std::int64_t frame) const noexcept REALTIME;

  const Bands& mean_square() const noexcept REALTIME { return mean_square_; }
  std::uint64_t bad_samples() const { return bad_samples_; }

  bool streams() const noexcept REALTIME { return here_ != nullptr; }
  std::size_t pieces() const noexcept REALTIME { return pieces_; }

  // Calls visit(piece) for those that a voice reads whose positions go from one frame to another,
  // until it returns false; then so does this.
  template <class Visit>
  bool for_pieces(std::int64_t from, std::int64_t to, const Visit& visit) const noexcept REALTIME {
    if (loop_frames_ == 0) return in_buffer(from, to, visit);
    if (to - from >= loop_frames_) return in_buffer(0, loop_frames_, visit);
    const std::int64_t wrapped = from % loop_frames_,
                       first = wrapped < 0 ? wrapped + loop_frames_ : wrapped;
    const std::int64_t last = first + (to - from);
    if (last < loop_frames_) return in_buffer(first, last, visit);
    return in_buffer(first, loop_frames_, visit) && in_buffer(0, last - loop_frames_, visit);
  }

  // Whether all of them are here. The audio thread may read them until it has told the loader that
  // it is done (SoundLoader::pass()).
  bool is_here(std::int64_t from, std::int64_t to) const noexcept REALTIME {
    return for_pieces(from, to, [this](std::size_t piece) noexcept REALTIME {
      return here_[piece].load(std::memory_order_seq_cst);
    });
  }
  void set_resident(std::size_t piece, bool here) {
    here_[piece].store(here, std::memory_order_seq_cst);
  }

  // The samples that a piece is made of, by frame; beyond the ends of what plays once there are
  // none, and a loop comes round.
  struct Window {
    std::int64_t first = 0;
    std::size_t frames = 0;
  };
  Window window(std::size_t piece) const;
  std::uint64_t frames() const { return frames_; }  // of the signal as it is stored

  // Makes a piece of the samples in its window; bring() it before.
  void make(std::size_t piece, std::vector<double> samples);

  // Its memory, touched, perhaps locked, and given back.
  std::size_t piece_bytes(std::size_t piece) const;
  bool bring(std::size_t piece);
  void decommit(std::size_t piece);

 private:
  // A call reads no farther: twice as many frames as it mixes, and some vectors.
  static constexpr int kReach = 2 * kMaxFrames + 64;
  static constexpr int kGuardFrames = 1024;
  static_assert(kGuardFrames >= kReach + 16 && kGuardFrames % kLowRate == 0);
  static const float* silence() noexcept REALTIME;

  // A stretch of a piece's memory, in bytes from the signal's first.
  struct Stretch {
    std::size_t first = 0, bytes = 0;
  };
  std::array<Stretch, 2> stretches(std::size_t piece) const;
  std::int64_t buffer_front() const noexcept REALTIME { return kGuardFrames + front_frames_; }
  void make_whole(std::vector<double> samples);
  void make_part(std::size_t piece, std::vector<double> window);

  // Of frames that are in the buffer, with the guards that a call may read.
  template <class Visit>
  bool in_buffer(std::int64_t from, std::int64_t to, const Visit& visit) const noexcept REALTIME {
    from += buffer_front() - kGuardFrames;
    to += buffer_front() + kGuardFrames;
    if (to < 0 || from >= buffer_frames_) return true;
    const std::int64_t per_piece = pieces_ == 1 ? buffer_frames_ : std::int64_t{kPieceFrames};
    const std::int64_t last = std::min(to, buffer_frames_ - 1) / per_piece;
    for (std::int64_t p = std::max<std::int64_t>(from, 0) / per_piece; p <= last; ++p)
      if (!visit(static_cast<std::size_t>(p))) return false;
    return true;
  }

  MixMode mode_;
  std::uint64_t frames_ = 0;
  std::int64_t loop_frames_ = 0;   // whole loops; 0: plays once
  std::int64_t front_frames_ = 0;  // what may be heard before frame 0, and where it is over
  std::int64_t end_frames_ = 0;
  std::int64_t buffer_frames_ = 0;  // all of it, guards too
  std::size_t pieces_ = 1;
  std::size_t high_bytes_ = 0, low_bytes_ = 0;  // whole pages

  std::shared_ptr<SoundMemory> memory_;
  std::size_t offset_ = 0;
  float* high_ = nullptr;  // frame 0
  float* low_ = nullptr;
  std::unique_ptr<std::atomic<bool>[]> here_;  // per piece, of one that streams
  Bands mean_square_{};
  std::uint64_t bad_samples_ = 0;
};

std::vector<PreparedSignal> prepare_signals(std::span<const Signal> signals,
                                            const MixMode& mode = {});

}  // namespace clamor
