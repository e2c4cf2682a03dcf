#include "common/bands.h"

#include <algorithm>
#include <cassert>

namespace clamor {

Bands bands_from_points(std::span<const double> hz, std::span<const double> values) {
  assert(!hz.empty() && hz.size() == values.size());
  assert(std::is_sorted(hz.begin(), hz.end()));
  Bands bands{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const double f = kBandCentres_hz[b];
    const auto above = std::lower_bound(hz.begin(), hz.end(), f);
    double value;
    if (above == hz.begin()) {
      value = values.front();
    } else if (above == hz.end()) {
      value = values.back();
    } else {
      const auto i = static_cast<std::size_t>(above - hz.begin());
      const double t = (f - hz[i - 1]) / (hz[i] - hz[i - 1]);
      value = values[i - 1] + t * (values[i] - values[i - 1]);
    }
    bands[b] = static_cast<float>(value);
  }
  return bands;
}

}  // namespace clamor
