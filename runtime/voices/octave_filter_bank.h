// octave_filter_bank.h: gives the eight bands of a mix their gains after the voices are summed.
//
// A voice's spectrum costs no filter of its own: it adds to buses with its gain in each band, and
// the buses are filtered once. Signals are parted when they are loaded, at 1.4 kHz and without
// phase, into a high layer (bands 5 to 7) and a low one (bands 0 to 4) at a quarter of the rate.
// Each layer's buses pass a tree of crossovers (crossover.h): a band takes its side of those on its
// way, and of the layer's others the all-pass that their two sides sum to. So
//
//     sum_b B_b = A, a pure all-pass, in each layer:
//
// equal gains come out exactly flat, and all bands of a layer are in phase at every frequency, so
// slopes between unequal gains are smooth and never notched. A's phase (30 ms at the lowest
// frequencies) is taken out of the layers when they are made: they are filtered by A backwards in
// time. The low layer's sum goes up to the full rate through a linear-phase filter of 49 taps
// (images below -100 dB); the high one waits for it. The whole is zero-phase with kBankDelayFrames.
//
// At its centre a band also hears its neighbours, each at 1 / 65. bus_gains() takes that out, so
// that a tone at a centre has the band's gain exactly, whatever the others are.
//
// Why not fewer buses? Of shapes as rooms make them (up to 12 reflections off four of the 25
// material presets, up to 340 m of air), with the worst band down to -40 dB: four basis shapes per
// voice, fitted by least squares, leave 68 % of them more than 0.5 dB wrong in some band, six still
// 24 %; 256 classes of spectra 68 %, 1024 classes 53 %. Eight gains are right for every shape.
// Eight buses at the full rate cost 2.3 to 2.4 full-band voices (cubic, two delays, AVX-512), four
// basis shapes 1.3, and eight gains at two rates 1.7 to 1.9.
//
// Recursions are per frame and in double: the result does not depend on how calls divide time.
#pragma once

#include <array>
#include <vector>

#include "common/bands.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/biquad_cascade.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

// A's backward tail falls below -150 dB in this many frames; of the parting's, in so many.
inline constexpr int kBankTailFrames = 8192;
inline constexpr int kPartingTailFrames = 1024;

inline constexpr int kBankDelayFrames = 24;

class OctaveFilterBank {
 public:
  OctaveFilterBank();

  // Filters and adds up `frames` (whole steps) of the buses into (left, right), each frame `stride`
  // samples after the one before.
  void process(const MixBuses& buses, int frames, float* interleaved,
               int stride = kEars) noexcept REALTIME;

  // |B_b| at a frequency, parting included: the closed form.
  static double magnitude(std::size_t band, double frequency_hz);

  // What the buses must be given for tones at the centres to come out with `gains`: the inverse of
  // magnitude() at the centres. Row b times the gains is bus b's.
  static const std::array<std::array<double, kBandCount>, kBandCount>& bus_gains();

  // The layers of a signal, phase undone. One that does not loop has kBankTailFrames more at its
  // front and kPartingTailFrames at its end. low[k] is frame kLowRate x k; a loop's low layer
  // repeats after as many samples as it takes to come round in steps of kLowRate.
  struct Layers {
    std::vector<double> high, low;
    Bands mean_square{};  // of what each band passes
  };
  // With `phase_undone` false they keep their own, and without `powers` there are none.
  static Layers part(const std::vector<double>& samples, bool loop, bool phase_undone = true,
                     bool powers = true);

  // The layers of a window cut from a signal, frame for frame, low[k] being its frame kLowRate x k:
  // right to -150 dB from kPartingTailFrames behind its beginning on to kPartingTailFrames +
  // kBankTailFrames before its end. No powers.
  static Layers part_window(std::vector<double> window, bool phase_undone = true);

  // Taps of the filter that takes the low layer to the full rate, 0 to 2 kBankDelayFrames.
  static double up_tap(int k);

 private:
  static constexpr int kTaps = 2 * kBankDelayFrames + 1;
  static constexpr int kLowHistory = kTaps / kLowRate;  // frames of the low layer before a call's

  HighCascade high_;
  LowCascade low_;
  std::array<double, kTaps> up_;
  double high_sum_[kEars][kBankDelayFrames + kMaxFrames] = {};
  double low_sum_[kEars][kLowHistory + kMaxFrames / kLowRate] = {};
};

}  // namespace clamor
