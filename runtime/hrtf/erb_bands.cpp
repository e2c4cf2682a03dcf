#include "runtime/hrtf/erb_bands.h"

#include <cmath>

namespace clamor {

double erb_width_hz(double frequency_hz) { return 24.7 * (0.00437 * frequency_hz + 1); }
double erb_number(double frequency_hz) { return 21.4 * std::log10(0.00437 * frequency_hz + 1); }
double erb_frequency_hz(double number) { return (std::pow(10, number / 21.4) - 1) / 0.00437; }

double erb_band_centre_hz(std::size_t band) {
  return erb_frequency_hz(static_cast<double>(band) + 1.5);
}

}  // namespace clamor
