// mix_kernel.h: the inner loop of the mixer, vectorised for the CPU that runs it.
//
// Voices add into buses, one row of frames per band and ear. With eight bands a signal is kept in
// two layers (prepared_signal.h): the upper three bands at the full rate, the lower five at a
// quarter of it. Eight band gains then cost 3 + 5 / 4 multiply-adds per ear and frame instead of
// eight. The octave filter bank filters the buses after the sum.
//
// Read positions are computed for tiles of 64 voices and one step at a time, in columns
// (mix_tile-inl.h). A chunk of 16 to 64 frames of the buses stays in registers for all voices of a
// tile. If a voice's integer offset is constant within the step, it reads contiguous neighbours
// with linearly changing fractions; the others, one in sixteen, are read in separate passes. Where
// neither delays nor gains change, each neighbour has one weight, which takes half the time.
//
// Cubic interpolation is a uniform B-spline over samples that were prefiltered at loading, so that
// whole delays reproduce the signal. runtime/README.md, "Mixing", has its errors and those of
// linear interpolation.
//
// Voices are summed in their order, except that within each tile resting ones come first, sliding
// ones after the others, and fast ones last. Multiply-adds are fused where the CPU can: CPUs may
// differ in the last bits, but on one CPU the result does not depend on how calls divide time.
// Highway is visible only in mix_*.cpp and mix_*-inl.h.
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
inline constexpr int kMaxSteps = 4;     // of one call
inline constexpr int kMaxFrames = kMaxSteps * kStepFrames;

inline constexpr int kBandLanes = kEars * static_cast<int>(kBandCount);
inline constexpr int kLowRate = 4;  // frames per frame of the low layer
inline constexpr int kLowBands = 5;
inline constexpr int kHighBands = static_cast<int>(kBandCount) - kLowBands;

// Binaural output has narrow bands, the lower ones in the low layer, and quadratures
// (hrtf_filter_bank.h).
inline constexpr std::size_t kHrtfLowBands = 12, kHrtfHighBands = 24;
inline constexpr std::size_t kHrtfBands = kHrtfLowBands + kHrtfHighBands;
inline constexpr std::size_t kHrtfQuadratures = 14;  // in the low layer
inline constexpr std::size_t kHrtfLowRows = kHrtfLowBands + kHrtfQuadratures;
inline constexpr int kHrtfLanes = kEars * static_cast<int>(kHrtfBands + kHrtfQuadratures);

inline constexpr int kGainFrames = 16;  // gain slopes are per this many frames, one vector

constexpr int band_lane(std::size_t band, int ear) { return kEars * static_cast<int>(band) + ear; }

enum class Interpolation : std::uint8_t { kLinear, kCubic };

struct MixMode {
  Interpolation interpolation = Interpolation::kCubic;
  int delays = 2;           // 1: both ears hear a voice at the delay of its first path
  bool eight_bands = true;  // otherwise each ear has one gain, that of band 0
  // Pairs of output channels. More than one pair needs delays = 1 and a panner.
  int pairs = 1;
  bool head = false;  // binaural: gains are in the bands of hrtf_filter_bank.h; needs delays = 2
  // Binaural: how many voices, the loudest, have narrow bands (narrowband_voices.h).
  int narrowband_voices = 128;
  bool field = false;  // keyframes may bring responses (field_mixer.h)

  // Gains of a voice: lanes at frame 0 of the segment, followed by as many slopes per kGainFrames.
  constexpr int gain_lanes() const { return head ? kHrtfLanes : eight_bands ? kBandLanes : kEars; }
  constexpr bool two_layers() const { return eight_bands || head; }
};

// The path along which a voice is read for one ear during one call. Its first frame is read at
// `position`, 32.32 fixed point, of a signal whose frame 0 is at `high`, and at a quarter of that
// in `low`. Each next frame is `step` farther, and the step grows by `bend` every kStepFrames. Both
// layers must have a frame before and two after.
struct VoicePath {
  const float* high = nullptr;
  const float* low = nullptr;
  std::int64_t position = 0;
  std::int64_t step = std::int64_t{1} << 32;  // always 0 to 2, which the caller ensures
  std::int64_t bend = 0;

  // The state `frame` frames into the call.
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

// Offset of the left ear's read position in the low layer, ahead of that in the high layer, in
// 32.32 frames of the full rate, and its change per frame. The right ear reads as far behind. HRTFs
// have a longer ITD at low frequencies.
struct LayerOffset {
  std::int64_t ahead = 0, step = 0;
};

// Arrays for the state of each voice in the next call. These arrays may be the ones that are
// read. A position that has reached its slot's `wrap` is reduced by it.
struct MixContinuation {
  VoicePath* paths = nullptr;   // [slot][kEars]; null: not written
  LayerOffset* gaps = nullptr;  // [slot], or null
  const std::int64_t* wraps = nullptr;
};

struct MixJob {
  const VoicePath* paths;  // [slot][kEars]
  const float* gains;      // [slot][2][gain_lanes()]
  const std::uint32_t* active;
  std::size_t count;  // of active slots
  int first_frame;    // of the segment
  int frames;         // whole steps, at most kMaxFrames
  // Rows of kMaxFrames and kMaxFrames / kLowRate frames by band and ear, which are added to.
  // Full-band voices use the first two rows of `high`.
  float* high;
  float* low;
  const LayerOffset* gaps = nullptr;  // [slot], or null
  MixContinuation next = {};
};

struct MixBuses {
  alignas(64) float high[kHighBands * kEars * kMaxFrames];
  alignas(64) float low[kLowBands * kEars * kMaxFrames / kLowRate];
};

void mix_voices(const MixMode& mode, const MixJob& job) noexcept REALTIME;

// The instruction set in use, such as "AVX3_ZEN4", and all that this CPU has, best first, "scalar"
// last. force_mix_kernel() is for tests and benchmarks, between calls only; an empty name restores
// the best.
std::string mix_kernel_target();
std::vector<std::string> mix_kernel_targets();
void force_mix_kernel(const std::string& target);

}  // namespace clamor
