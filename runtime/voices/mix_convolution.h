// mix_convolution.h: fast convolution of many stereo pairs, each with its own symmetric filter,
// into one stereo sum. Same result as mix_fir.h, by overlapping blocks in the frequency domain.
//
// A symmetric filter has a real spectrum, so left and right pass through it as the real and
// imaginary part of one complex signal. Eight pairs share a vector (lane_fourier.h), and filter
// spectra are stored in the order of its spectra. For 24 pairs of 512 frames and 385 taps it takes
// a tenth of the time of direct convolution. Highway is visible only in mix_*.cpp.
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

// Spectra of symmetric filters [filter][tap] with an odd number of taps, as [group of
// lanes][bin][lane] in the order of LaneFourier, scaled so that a round trip has gain 1.
std::vector<float> spectra_of(const std::vector<float>& filters, std::size_t taps);

struct SpectrumJob {
  const float* filters;  // as spectra_of() makes them
  int groups;            // of lanes
  const float* pairs;    // [group][2][frames][lane]
  int frames;            // at most kSpectrumSize; zero-padded
  LaneSpectrum* work;
  LaneSpectrum* sum;  // overwritten; the sum of all filtered pairs is the sum over its lanes
};

void filter_pairs(const SpectrumJob& job) noexcept REALTIME;

}  // namespace clamor
