#include "tools/analysis/erb_spectrum.h"

#include <algorithm>

#include "tools/analysis/sound_spectrum.h"

namespace clamor {

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
