// interaural_times.h: estimates interaural time differences (ITD) from measured responses of both
// ears: above 1.4 kHz, below, and in single ERB bands below.
//
// All come from the cross-spectrum L R*, whose phase is the delay of the right ear. Above 1.4 kHz
// ears follow the envelope, and the ITD is the maximum of the envelope of the cross-correlation.
// Below, ears follow the waveform, and the ITD is the maximum of the cross-correlation itself with
// equal weights from 90 to 850 Hz, where a head delays sound most.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <vector>

#include "common/fourier.h"

namespace clamor {

// The ERB bands below 1.4 kHz, whose phase is matched; counted from the first of erb_bands.h.
inline constexpr std::size_t kPhaseBands = 17;

struct InterauralTimes {
  double high_s = 0, low_s = 0;

  struct Phase {
    double radians = 0;       // delay of the right ear beyond low_s
    double max_radians = 0;   // tolerance: 20 us, or 5 % of the ITD
    bool is_defined = false;  // otherwise the phase is undefined
  };
  std::array<Phase, kPhaseBands> phases{};
};

// `frames` is the length of the responses; `fourier` has the size of their spectra. A band's phase
// is undefined if a response is shorter than a period of its centre (11.6 ms is, below 86 Hz), or
// if the interaural coherence in the band is below kMinCoherence.
inline constexpr double kMinCoherence = 0.5;
InterauralTimes interaural_times(const Fourier& fourier, double rate_hz, std::size_t frames,
                                 const std::vector<std::complex<double>>& left,
                                 const std::vector<std::complex<double>>& right);

}  // namespace clamor
