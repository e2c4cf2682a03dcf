// hrtf_filter_bank.h: the filter bank that applies HRTFs to a mix.
//
// An HRTF at one direction is a delay of each layer plus 36 band gains and 14 quadrature gains an
// ear. Voices add to 50 buses an ear with these gains times their own spectrum, and the buses are
// filtered once per block. Only the additions grow with the number of voices.
//
// At 122 multiply-adds per frame, these additions limit a core to 5000 voices. Most voices
// (narrowband_voices.h) therefore add to eight octave buses an ear, as they would without an HRTF.
// Once per block, each of the 36 bands takes its share of the two octaves around it. Both methods
// have the same delays and nearly the same phases, so a voice can crossfade between them.
//
// The bands are triangular in the ERB scale between the frequencies of kHrtfNodes_hz, one ERB apart
// from 1.3 kHz up, so band gains are interpolated linearly between nodes. Filters are symmetric:
// bands are always in phase, and the delay alone carries the ITD. Since triangles add up to 1,
// equal gains leave a sound unchanged. The lower 12 bands run in the low layer
// (octave_filter_bank.h) at a quarter of the rate. Filters are truncated to 31 and 8 ms, which
// widens the lowest bands a little.
//
// Below 1.4 kHz ears follow the waveform, and one delay is not enough: a measured head delays 300
// Hz by 0.1 ms more than 1 kHz. The low layer therefore also has antisymmetric (quadrature)
// filters, triangular between kQuadratureNodes_hz, that lead by a quarter of a period (and below a
// node by less and less, as the phase of a delay does). Gain cos p in a band and sin p in its
// quadrature advance the phase by p (hrtf_phase_fit.h).
//
// The latency is kHrtfDelayFrames (16 ms). The mixer reads ahead by as much, so gains are that
// late.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "runtime/hrtf/hrtf_filters.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/mix_convolution.h"
#include "runtime/voices/mix_kernel.h"
#include "runtime/voices/octave_filter_bank.h"

namespace clamor {

inline constexpr int kHrtfDelayFrames = 768;

class HrtfFilterBank {
 public:
  HrtfFilterBank();

  // The buses that voices add to, as MixJob takes them. clear() must come first.
  float* high() noexcept REALTIME { return buses_.high; }
  float* low() noexcept REALTIME { return buses_.low; }
  MixBuses& octaves() noexcept REALTIME { return octaves_; }

  // Ramps the gains of the octave buses' sum to `levels` over the next `frames` frames (initially
  // 1).
  void slide_octaves(const std::array<HrtfGains, kEars>& levels, int frames) noexcept REALTIME {
    levels_.begin(levels, frames);
  }
  void clear() noexcept REALTIME;

  // Filters and adds up `frames` (whole steps) into (left, right).
  void process(int frames, float* interleaved) noexcept REALTIME;

 private:
  static constexpr int kHighReach = kHrtfHighLayer.reach, kLowReach = kHrtfLowLayer.reach;
  static constexpr int kHighTaps = kHrtfHighLayer.taps(), kLowTaps = kHrtfLowLayer.taps();
  static constexpr int kUpTaps = 2 * kBankDelayFrames + 1;
  static_assert(kLowRate * kLowReach + kBankDelayFrames == kHrtfDelayFrames);
  // The high layer runs in blocks of this size, counted from the beginning however calls divide
  // time. The end of a block's output is not due before the block is complete.
  static constexpr int kBlockFrames = 512, kHighHistory = kHighTaps - 1;
  static constexpr int kHighWindow = kHighHistory + kBlockFrames;
  static constexpr int kHighGroups = static_cast<int>(kHrtfHighBands) / kSpectrumLanes;
  // Output ahead of time at the end of a block.
  static constexpr int kHighAhead = kHrtfDelayFrames - kHighReach;
  static_assert(kHighAhead >= kBlockFrames && kHighWindow <= kSpectrumSize);
  static_assert(kHrtfHighBands % kSpectrumLanes == 0 && kBlockFrames % kStepFrames == 0);
  static constexpr int kLowHistory = 2 * kLowReach;
  static constexpr int kLowRow = kLowHistory + kMaxFrames / kLowRate;
  static constexpr int kUpHistory = kUpTaps / kLowRate;

  struct Buses {
    alignas(64) float high[kHrtfHighBands * kEars * kMaxFrames];
    alignas(64) float low[kHrtfLowRows * kEars * kMaxFrames / kLowRate];
  };
  static const std::vector<float>& high_spectra();

  // Linear ramps of the octave buses' levels.
  struct LevelRamps {
    struct Ramp {
      float level = 1, per_frame = 0;  // at frame 0
    };
    std::array<std::array<Ramp, kHrtfBands>, kEars> ramps{};
    int frame = 0, frames = 0;  // done, and total

    // The level `ahead` frames from now. Calls never go beyond the end of a ramp.
    float at(int ear, std::size_t band, int ahead) const noexcept REALTIME;
    void begin(const std::array<HrtfGains, kEars>& levels, int frames) noexcept REALTIME;
    void advance(int by_frames) noexcept REALTIME;
  };
  void take_high(int first_frame, int frames) noexcept REALTIME;
  void filter_high_block() noexcept REALTIME;

  LevelRamps levels_;
  Buses buses_{};
  MixBuses octaves_{};
  std::vector<float> high_;  // [group][ear][frame of kHighWindow][lane]
  int high_frames_ = 0;      // of the block
  LaneSpectrum work_{}, sum_{};
  float high_sum_[kEars][kHighAhead + kMaxFrames] = {};  // output not yet due
  int high_due_ = kHighAhead;
  std::vector<float> low_;  // [ear][band or quadrature][row]: history, then the call's frames
  float low_sum_[kEars][kUpHistory + kMaxFrames / kLowRate] = {};
  std::array<float, kUpTaps> up_{};
};

}  // namespace clamor
