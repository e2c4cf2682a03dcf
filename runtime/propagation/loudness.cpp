#include "runtime/propagation/loudness.h"

#include <complex>
#include <numbers>

namespace clamor {

Bands loudness_weights() {
  const auto response = [](double hz, double b0, double b1, double b2, double a1, double a2) {
    const std::complex<double> z = std::polar(1.0, -2 * std::numbers::pi * hz / 48000);
    return (b0 + z * (b1 + z * b2)) / (1.0 + z * (a1 + z * a2));
  };
  Bands weights{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const double hz = kBandCentres_hz[b];
    const auto head = response(hz, 1.53512485958697, -2.69169618940638, 1.19839281085285,
                               -1.69065929318241, 0.73248077421585);
    const auto low_cut = response(hz, 1, -2, 1, -1.99004745483398, 0.99007225036621);
    weights[b] = static_cast<float>(std::norm(head * low_cut));
  }
  return weights;
}

}  // namespace clamor
