// interaural_times.h: how much later the right ear hears a sound than the left, as measured
// responses of both have it: above 1.4 kHz, below, and band by band below.
//
// All from the cross-spectrum L R*, whose phase at a frequency is how much later the right ear is.
// Above 1.4 kHz, where ears follow the envelope, the time is where the envelope of the
// cross-correlation has its maximum; below, where they follow the wave, the correlation itself,
// with all frequencies from 90 to 850 Hz weighing the same: a head holds these up most.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <vector>

#include "common/fourier.h"

namespace clamor {

// Of the ERB bands below 1.4 kHz, which are followed in phase; from erb_bands.h's first on.
inline constexpr std::size_t kPhaseBands = 17;

struct InterauralTimes {
  double high_s = 0, low_s = 0;

  struct Phase {
    double radians = 0;      // by which the right ear is later than low_s has it
    double max_radians = 0;  // by which it may be missed: 20 us, or 5 % of the time between ears
    bool told = false;       // otherwise it means nothing
  };
  std::array<Phase, kPhaseBands> phases{};
};

// Of responses of `frames` frames, whose spectra have `fourier`'s size. A band's phase is not told
// if a response is shorter than the period of its centre, as 11.6 ms are below 86 Hz, or if the
// ears are less alike in it than kMinCoherence.
inline constexpr double kMinCoherence = 0.5;
InterauralTimes interaural_times(const Fourier& fourier, double rate_hz, std::size_t frames,
                                 const std::vector<std::complex<double>>& left,
                                 const std::vector<std::complex<double>>& right);

}  // namespace clamor
