// mix_kernel.h: the inner loop of the mixer, for whatever vectors the CPU has.
//
// Voices add into buses, one row of frames per band and ear. With eight bands a signal is kept in
// two layers (prepared_signal.h): the upper three bands at the full rate, the lower five at a
// quarter of it, so that eight band gains cost 3 + 5 / 4 multiply-adds per ear and frame instead of
// eight, and one and a quarter reads instead of one. The octave bank filters the buses after the
// sum.
//
// Where 64 voices read is worked out for a step at a time, in columns (mix_tile-inl.h). A chunk of
// 16 to 64 frames of the buses then stays in registers while voices pass by. Where a voice's whole
// offset does not change within the step, its neighbours are contiguous loads and its fraction a
// line; the others, one in sixteen, are read in passes of their own: across the one place where the
// offset changes, or, if they slide fast, vector by vector. Where voices go on in the next call is
// known when the last step is done, and written there if that is asked for.
//
// Cubic interpolation is a uniform B-spline over samples that were prefiltered when loaded, so that
// whole delays give back the signal. Its largest error, at a fraction of one half, relative to the
// tone: -122 dB at 1 kHz, -98 at 2, -74 at 4, -48 at 8, -31 at 12 and -18 at 16 kHz, some 20 dB
// below Catmull-Rom at the same cost. The low layer, at a quarter of the rate, has -74 dB at 1 kHz
// and -61 at 1.4 kHz, where it ends. Linear has -53, -29, -18 and -6 dB at 1, 4, 8 and 16 kHz.
//
//     kHz                       1      2      4      8     12     16
//     cubic, half-way, dB       0      0      0  -0.04  -0.24  -1.16    at its weakest
//            mean               0      0      0  -0.02  -0.13  -0.58    of a voice that slides
//            images          -131   -107    -82    -56    -38    -25    all together
//     linear, half-way      -0.02  -0.08  -0.30  -1.25  -3.01  -6.02
//            mean           -0.01  -0.05  -0.20  -0.80  -1.82  -3.29
//            images           -64    -52    -40    -27    -20    -15
//
// Frames are added in the order of the voices, in each 64 of them those that slide last, fast ones
// after the others; multiply-adds are fused where the CPU can, so CPUs differ in last bits and runs
// on one CPU do not, however calls divide time. Highway is visible only in mix_*.cpp and
// mix_*-inl.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/bands.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

inline constexpr int kEars = 2;
inline constexpr int kStepFrames = 64;  // calls mix whole steps; divides kKeyframeFrames
inline constexpr int kMostSteps = 4;    // of one call
inline constexpr int kMaxFrames = kMostSteps * kStepFrames;

inline constexpr int kBandLanes = kEars * static_cast<int>(kBandCount);
inline constexpr int kLowRate = 4;  // frames per frame of the low layer
inline constexpr int kLowBands = 5;
inline constexpr int kHighBands = static_cast<int>(kBandCount) - kLowBands;

// Binaural: narrow bands, the lower ones in the low layer, and quadratures (hrtf_filter_bank.h).
inline constexpr std::size_t kHrtfLowBands = 12, kHrtfHighBands = 24;
inline constexpr std::size_t kHrtfBands = kHrtfLowBands + kHrtfHighBands;
inline constexpr std::size_t kHrtfQuadratures = 14;  // also in the low layer
inline constexpr std::size_t kHrtfLowRows = kHrtfLowBands + kHrtfQuadratures;
inline constexpr int kHrtfLanes = kEars * static_cast<int>(kHrtfBands + kHrtfQuadratures);

inline constexpr int kGainFrames = 16;  // slopes of gains are per so many frames: a vector's

constexpr int band_lane(std::size_t band, int ear) { return kEars * static_cast<int>(band) + ear; }

enum class Interpolation : std::uint8_t { kLinear, kCubic };

struct MixMode {
  Interpolation interpolation = Interpolation::kCubic;
  int delays = 2;           // 1: both ears hear a voice at its first path's delay
  bool eight_bands = true;  // otherwise each ear has one gain: a voice's band 0
  // Of output channels. More than one pair takes one delay, and a panner says what goes where.
  int pairs = 1;
  bool head =
      false;  // binaural: a voice's gains are in the bands of hrtf_filter_bank.h; two delays
  int fine_voices =
      128;  // binaural: so many have them at a time, the loudest (narrowband_voices.h)

  // Gains of a voice: those of the segment's frame 0, then how they grow in kGainFrames.
  constexpr int gain_lanes() const { return head ? kHrtfLanes : eight_bands ? kBandLanes : kEars; }
  constexpr bool two_layers() const { return eight_bands || head; }
};

// How a voice reaches an ear during one call: its first frame is read at `position`, 32.32 fixed
// point, of a signal whose frame 0 is at `high`, and a quarter of that in `low`; the next ones each
// `step` farther, and from one kStepFrames to the next the step grows by `bend`. Of both layers, a
// frame before and two after must be there.
struct VoicePath {
  const float* high = nullptr;
  const float* low = nullptr;
  std::int64_t position = 0;
  std::int64_t step = std::int64_t{1} << 32;  // always 0 to 2: the caller sees to that
  std::int64_t bend = 0;

  // After so many frames of the call.
  constexpr std::int64_t position_at(std::int64_t frame) const noexcept REALTIME {
    return position + frame * step + bends_at(frame) * bend;
  }
  constexpr std::int64_t step_at(std::int64_t frame) const noexcept REALTIME {
    return step + frame / kStepFrames * bend;
  }
  static constexpr std::int64_t bends_at(std::int64_t frame) noexcept REALTIME {
    const std::int64_t steps = frame / kStepFrames;
    return steps * (frame - kStepFrames / 2 * (steps + 1));
  }
};

// How far ahead of its place in the high layer a voice's low layer is read by the left ear, 32.32
// frames of the full rate, and how that grows per frame; the right ear is as far behind. A head's
// low frequencies have delays of their own.
struct LayerOffset {
  std::int64_t ahead = 0, step = 0;
};

// Where voices go on in the next call, as they do in this one: in arrays by slot, which may be
// those that are read. A position that has come as far as its slot's wrap goes back by that.
struct MixContinuation {
  VoicePath* paths = nullptr;   // [slot][kEars]; null: nothing is written
  LayerOffset* gaps = nullptr;  // [slot], or null where there are none
  const std::int64_t* wraps = nullptr;
};

struct MixJob {
  const VoicePath* paths;  // [slot][kEars]
  const float* gains;      // [slot][2][gain_lanes()]
  const std::uint32_t* active;
  std::size_t count;  // of active slots
  int first_frame;    // of the segment
  int frames;         // whole steps, at most kMaxFrames
  // Rows of kMaxFrames and kMaxFrames / kLowRate, in order of band and ear. Added to. Full-band
  // voices use the first two of high.
  float* high;
  float* low;
  const LayerOffset* gaps = nullptr;  // [slot], or null where there are none
  MixContinuation next = {};
};

struct MixBuses {
  alignas(64) float high[kHighBands * kEars * kMaxFrames];
  alignas(64) float low[kLowBands * kEars * kMaxFrames / kLowRate];
};

void mix_voices(const MixMode& mode, const MixJob& job) noexcept REALTIME;

// The instruction set that is used, for benchmarks: "AVX3_ZEN4"; and those that could be, best
// first, "scalar" last. force_mix_kernel() is for tests and benchmarks, between calls only; an
// empty name goes back to the best.
std::string mix_kernel_target();
std::vector<std::string> mix_kernel_targets();
void force_mix_kernel(const std::string& target);

}  // namespace clamor
