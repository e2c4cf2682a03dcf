// hrtf_filter_bank.h: the narrow bands in which a voice gets the colour that a head gives it.
//
// A head's response to a direction is a delay of each layer and a level in each of 36 bands an ear
// and 14 quadratures. Voices add to 50 buses an ear with these levels times their own spectrum, and
// the buses are filtered once per block: what a head costs does not grow with the voices, but for
// the additions.
//
// Those grow too fast for all: 122 multiply-adds a frame, of which a core does 5000 voices.
// So most voices (narrowband_voices.h says which) add to eight buses an ear, a level per octave, as
// they would without a head, and once per block each of the 36 takes its share of the two octaves
// that it lies between. Both ways have the same delays, and phases that differ by little, so a
// voice may slide from one to the other.
//
// The bands are hats between the frequencies of kHrtfNodes_hz, linear in the ERB scale, one ERB
// apart from 1.3 kHz up, as the ear's are; so levels between two nodes are interpolated. Their
// filters are symmetric: no band is ever out of phase with another, the delay alone tells the time,
// and since hats add up to 1, equal levels leave a sound as it was. The lower 12 run in the low
// layer (octave_filter_bank.h) at a quarter of the rate. Filters are cut to 31 and 8 ms, which
// widens the lowest hats a little.
//
// Below 1.4 kHz ears follow the wave, and there one delay is not enough: a measured head holds up
// 300 Hz by 0.1 ms more than 1 kHz. So the low layer has antisymmetric filters as well, hats
// between kQuadratureNodes_hz a quarter of a period ahead (and below a node ever less, as a delay's
// phase is): level cos p in a band and level sin p in its quadrature are a sound that is ahead by p
// there (hrtf_phase_fit.h).
//
// Sounds come kHrtfDelayFrames (16 ms) late, which the mixer reads ahead; gains are that late.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/bands.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/mix_convolution.h"
#include "runtime/voices/mix_kernel.h"
#include "runtime/voices/octave_filter_bank.h"

namespace clamor {

inline constexpr int kHrtfDelayFrames = 768;

// Ascending.
extern const std::array<double, kHrtfBands> kHrtfNodes_hz;

extern const std::array<double, kHrtfQuadratures> kQuadratureNodes_hz;

using HrtfGains = std::array<float, kHrtfBands>;  // amplitude
using QuadratureGains = std::array<float, kHrtfQuadratures>;

class HrtfFilterBank {
 public:
  HrtfFilterBank();

  // Where voices add to, as MixJob wants it: cleared first.
  float* high() noexcept REALTIME { return buses_.high; }
  float* low() noexcept REALTIME { return buses_.low; }
  MixBuses& octaves() noexcept REALTIME { return octaves_; }

  // What comes from buses of octaves is multiplied by these levels in so many frames from now on,
  // in straight lines from what it is multiplied by now (at first, 1).
  void slide_octaves(const std::array<HrtfGains, kEars>& levels, int frames) noexcept REALTIME;
  void clear() noexcept REALTIME;

  // Filters and adds up `frames` (whole steps) into (left, right).
  void process(int frames, float* interleaved) noexcept REALTIME;

  // |B_band| at a frequency, parting included, and that of a quadrature.
  static double magnitude(std::size_t band, double frequency_hz);
  static double quadrature_magnitude(std::size_t quadrature, double frequency_hz);

  // A voice's gains in octaves as those at the nodes: linear in the octaves between their centres,
  // and right at them.
  static HrtfGains levels_of(const Bands& gains) noexcept REALTIME;

  // Levels at the quadratures' nodes.
  static QuadratureGains at_quadratures(const HrtfGains& levels) noexcept REALTIME;

  // What the buses of octaves must be given for tones at the centres to come out with `gains`: row
  // b times the gains is bus b's. And what such a bus is in a band, 0 in the other layer's.
  using OctaveMatrix = std::array<std::array<double, kBandCount>, kBandCount>;
  static const OctaveMatrix& bus_gains();
  static float octave_share(std::size_t octave, std::size_t band) noexcept REALTIME;

 private:
  static constexpr int kHighReach = 192, kLowReach = 186;  // taps to either side
  static constexpr int kHighTaps = 2 * kHighReach + 1, kLowTaps = 2 * kLowReach + 1;
  static constexpr int kUpTaps = 2 * kBankDelayFrames + 1;
  static_assert(kLowRate * kLowReach + kBankDelayFrames == kHrtfDelayFrames);
  // The high layer in blocks of so many frames, counted from the beginning, however calls divide
  // time: what a block's filters end with is due not before the block is whole.
  static constexpr int kBlockFrames = 512, kHighHistory = kHighTaps - 1;
  static constexpr int kHighWindow = kHighHistory + kBlockFrames;
  static constexpr int kHighGroups = static_cast<int>(kHrtfHighBands) / kSpectrumLanes;
  static constexpr int kHighAhead =
      kHrtfDelayFrames - kHighReach;  // of what is due, at a block's end
  static_assert(kHighAhead >= kBlockFrames && kHighWindow <= kSpectrumSize);
  static_assert(kHrtfHighBands % kSpectrumLanes == 0 && kBlockFrames % kStepFrames == 0);
  static constexpr int kLowHistory = 2 * kLowReach;
  static constexpr int kLowRow = kLowHistory + kMaxFrames / kLowRate;
  static constexpr int kUpHistory = kUpTaps / kLowRate;

  struct Buses {
    alignas(64) float high[kHrtfHighBands * kEars * kMaxFrames];
    alignas(64) float low[kHrtfLowRows * kEars * kMaxFrames / kLowRate];
  };
  static const std::vector<float>& high_filters();  // [band][tap]
  static const std::vector<float>& low_filters();   // bands, then quadratures
  static const std::vector<float>& high_spectra();

  struct Slide {
    float level = 1, per_frame = 0;  // frame 0's
  };
  float slid(int ear, std::size_t band, int frame) const noexcept REALTIME;
  void take_high(int first_frame, int frames) noexcept REALTIME;
  void filter_high_block() noexcept REALTIME;

  std::array<std::array<Slide, kHrtfBands>, kEars> slides_{};
  int slide_frame_ = 0, slide_frames_ = 0;  // done, and in all

  Buses buses_{};
  MixBuses octaves_{};
  std::vector<float> high_;  // [group][ear][frame of kHighWindow][lane]
  int high_frames_ = 0;      // of the block
  LaneSpectrum work_{}, sum_{};
  float high_sum_[kEars][kHighAhead + kMaxFrames] = {};  // what is due next
  int high_due_ = kHighAhead;
  std::vector<float> low_;  // [ear][band or quadrature][row]: history, then the call's frames
  float low_sum_[kEars][kUpHistory + kMaxFrames / kLowRate] = {};
  std::array<float, kUpTaps> up_{};
};

}  // namespace clamor
