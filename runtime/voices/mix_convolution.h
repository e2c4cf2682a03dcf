// mix_convolution.h: pairs of signals, each pair through its own symmetric filter, into one pair of
// sums: what mix_fir.h does, by overlapping blocks in the spectrum.
//
// A symmetric filter has a real spectrum, so left and right go through it as the real and imaginary
// part of one signal. Eight pairs lie side by side in lanes, so that transforms are the same few
// lines for all: radix 2, in place, forward in decimated frequency and back in decimated time, so
// that neither puts the spectrum in order: it stays bit-reversed, and filters are made so.
//
// J. W. Cooley, J. W. Tukey. An Algorithm for the Machine Calculation of Complex Fourier Series.
// Math. Comp. 19, 1965. For 24 pairs of 512 frames and 385 taps: a tenth of the time that their
// multiply-adds take. Highway is visible only in mix_*.cpp.
#pragma once

#include <cstddef>
#include <vector>

#include "runtime/realtime/realtime.h"

namespace clamor {

inline constexpr int kSpectrumSize = 1024, kSpectrumLanes = 8;

// [frame or bin][lane]
struct alignas(64) LaneSpectrum {
  float left[kSpectrumSize * kSpectrumLanes];
  float right[kSpectrumSize * kSpectrumLanes];
};

// Of symmetric filters, [filter][tap], an odd number of taps: [group of lanes][bin][lane], in the
// order of the bins here, and such that there and back is a factor of 1.
std::vector<float> spectra_of(const std::vector<float>& filters, std::size_t taps);

struct SpectrumJob {
  const float* filters;  // as spectra_of() makes them
  int groups;            // of lanes
  const float* pairs;    // [group][2][frames][lane]
  int frames;            // at most kSpectrumSize; silence follows
  LaneSpectrum* work;
  LaneSpectrum* sum;  // overwritten: the sum of all filtered pairs is that of the lanes
};

void filter_pairs(const SpectrumJob& job) noexcept REALTIME;

}  // namespace clamor
