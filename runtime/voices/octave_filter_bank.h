// octave_filter_bank.h: filters the eight band buses of a mix after the voices are summed.
//
// No voice has a filter of its own: it adds to the buses with its gain in each band, and the buses
// are filtered once. Signals are split at loading, at 1.4 kHz and with zero phase, into a high
// layer (bands 5 to 7) and a low layer (bands 0 to 4) at a quarter of the rate. In each layer the
// buses pass a tree of crossovers (crossover.h): a band takes its side of the crossovers on its
// path, and the all-pass to which both sides sum for all others. So
//
//     sum_b B_b = A, a pure all-pass, in each layer.
//
// Equal gains therefore come out exactly flat. All bands of a layer are in phase at every
// frequency, so transitions between unequal gains are smooth and without notches. A's phase (30 ms
// at the lowest frequencies) is removed when the layers are made, by filtering them with A
// backwards in time. The low layer is upsampled by a linear-phase filter of 49 taps (images below
// -100 dB), and the high layer is delayed to match. The whole bank has zero phase and a latency of
// kBankDelayFrames.
//
// At its centre a band also passes 1 / 65 of each neighbour. bus_gains() compensates for that, so
// that a tone at a centre has exactly the band's gain, whatever the others are.
//
// Why not fewer buses? Spectra of typical rooms (up to 12 reflections off four of the 25 material
// presets, up to 340 m of air, weakest band down to -40 dB) were fitted by least squares. With four
// basis shapes per voice, 68 % of them are more than 0.5 dB wrong in some band, with six still 24
// %; with 256 classes of spectra 68 %, with 1024 classes 53 %. Eight gains are right for every
// spectrum. Eight buses at the full rate cost 2.3 to 2.4 full-band voices (cubic, two delays,
// AVX-512), four basis shapes 1.3, and eight gains at two rates 1.7 to 1.9.
//
// Recursions are per frame and in double, so the result does not depend on how calls divide time.
#pragma once

#include <array>
#include <vector>

#include "common/bands.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/biquad_cascade.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

// Lengths after which A's backward tail and the layer split's response are below -150 dB.
inline constexpr int kBankTailFrames = 8192;
inline constexpr int kPartingTailFrames = 1024;

inline constexpr int kBankDelayFrames = 24;

class OctaveFilterBank {
 public:
  OctaveFilterBank();

  // Filters the buses and adds up `frames` frames (whole steps) into (left, right), each frame
  // `stride` samples after the last.
  void process(const MixBuses& buses, int frames, float* interleaved,
               int stride = kEars) noexcept REALTIME;

  // |B_b| at a frequency including the layer split, in closed form.
  static double magnitude(std::size_t band, double frequency_hz);

  // The bus gains that give tones at the band centres the wanted gains: the inverse of magnitude()
  // at the centres. Row b times the gains is the gain of bus b.
  static const std::array<std::array<double, kBandCount>, kBandCount>& bus_gains();

  // The layers of a signal with the phase removed. A signal that does not loop has kBankTailFrames
  // more at its front and kPartingTailFrames more at its end. low[k] is frame kLowRate x k. A
  // loop's low layer repeats after as many samples as it takes to come round in steps of kLowRate.
  struct Layers {
    std::vector<double> high, low;
    Bands mean_square{};  // of each band's output
  };
  // Without `phase_undone` the layers keep their phase; without `powers` mean_square is not
  // computed.
  static Layers part(const std::vector<double>& samples, bool loop, bool phase_undone = true,
                     bool powers = true);

  // The layers of a window cut from a signal, frame for frame; low[k] is frame kLowRate x k of the
  // window. Exact to -150 dB from kPartingTailFrames after its beginning to kPartingTailFrames +
  // kBankTailFrames before its end. No powers.
  static Layers part_window(std::vector<double> window, bool phase_undone = true);

  // Taps of the upsampling filter of the low layer, 0 to 2 kBankDelayFrames.
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
