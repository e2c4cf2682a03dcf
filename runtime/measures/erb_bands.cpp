#include "runtime/measures/erb_bands.h"

#include <algorithm>
#include <cmath>

#include "runtime/measures/sound_spectrum.h"

namespace clamor {

double erb_width_hz(double frequency_hz) { return 24.7 * (0.00437 * frequency_hz + 1); }
double erb_number(double frequency_hz) { return 21.4 * std::log10(0.00437 * frequency_hz + 1); }
double erb_frequency_hz(double number) { return (std::pow(10, number / 21.4) - 1) / 0.00437; }

double erb_band_centre_hz(std::size_t band) {
  return erb_frequency_hz(static_cast<double>(band) + 1.5);
}

ErbBands erb_spectrum(std::span<const double> energy) {
  ErbBands bands{};
  const double width_hz = spectrum_bin_hz(1);
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    const double low = erb_frequency_hz(static_cast<double>(b) + 1) / width_hz;
    const double high = erb_frequency_hz(static_cast<double>(b) + 2) / width_hz;
    const auto last = static_cast<std::size_t>(high + 0.5);
    for (auto k = static_cast<std::size_t>(low + 0.5); k <= last && k < energy.size(); ++k) {
      const double bin = static_cast<double>(k);
      bands[b] += energy[k] * (std::min(high, bin + 0.5) - std::max(low, bin - 0.5));
    }
  }
  return bands;
}

}  // namespace clamor
