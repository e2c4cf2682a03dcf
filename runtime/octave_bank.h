// octave_bank.h: gives the eight bands of a mix their gains after the voices are summed.
//
// Voices add into a bus of 16 lanes (8 bands x 2 ears) with their gain in each band. This bank
// filters lane (b, e) by B_b and adds the bands of an ear: a voice's spectrum costs no filter of
// its own. B_b is the band's path through a tree of Linkwitz-Riley crossovers of order 8
// (Butterworth 4 twice) at the geometric means of neighbouring centres: at each of the 3 crossovers
// on its way it takes the low or the high side; for the 4 others the all-pass that their two sides
// sum to. With D the Butterworth polynomial,
//
//     low = 1 / D^2,   high = s^8 / D^2,   low + high = D(-s) / D(s),   so   sum_b B_b = A,
//
// a pure all-pass: equal gains come out exactly flat, without latency, and all bands are in phase at
// every frequency, so that slopes between unequal gains are smooth and never notched. What is left,
// A's phase (19 ms at the lowest frequencies), is taken out of the signals when they are loaded:
// undo_phase() filters them by A backwards in time, and the whole chain is zero-phase.
//
// Recursions are per frame and in double: the result does not depend on how calls divide time.
// Cost: 16 us per 256 frames with AVX-512, whatever the number of voices.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "runtime/mix_kernel.h"
#include "runtime/realtime.h"

namespace clamor {

// A's backward tail falls below -150 dB in this many frames.
inline constexpr int kBankTailFrames = 4096;

class OctaveBank {
 public:
  OctaveBank();

  // Filters and adds up bus[frames][kBusLanes] into interleaved (left, right). At most kStepFrames.
  void process(const float* bus, int frames, float* interleaved) noexcept REALTIME;

  // |B_b| at a frequency, the closed form: sides of w^8 and 1 over 1 + w^8, w the ratio to the
  // crossover after the bilinear transform's warping.
  static double magnitude(std::size_t band, double frequency_hz);

  // Filters `samples` by 1 / A, circularly where the signal loops. One that does not loop grows
  // kBankTailFrames at its front: what must come before its first sample.
  static void undo_phase(std::vector<double>& samples, bool loop);

  // Mean square of what each band passes of `samples`.
  static Bands mean_squares(std::span<const float> samples);

 private:
  LaneCascade cascade_;
};

}  // namespace clamor
