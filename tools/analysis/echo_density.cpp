#include "tools/analysis/echo_density.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/sample_rate.h"
#include "tools/analysis/hann_window.h"

namespace clamor {

namespace {

constexpr std::size_t kHalf = kSampleRate_hz / 100;  // of 20 ms
constexpr auto kHop_frames = static_cast<std::size_t>(kEchoDensityHop_s * kSampleRate_hz);

}  // namespace

std::vector<double> echo_density(std::span<const double> response, std::size_t first) {
  std::vector<double> window = hann_window(2 * kHalf + 1, 2 * kHalf);
  for (double& weight : window) weight /= kHalf;
  const double gaussian = std::erfc(1 / std::numbers::sqrt2);

  std::vector<double> densities;
  for (std::size_t centre = first; centre < response.size(); centre += kHop_frames) {
    const std::size_t begin = centre < kHalf ? kHalf - centre : 0;  // within the window
    const std::size_t end = std::min(window.size(), response.size() + kHalf - centre);
    double variance = 0, beyond = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const double h = response[centre + i - kHalf];
      variance += window[i] * h * h;
    }
    const double sigma = std::sqrt(variance);
    for (std::size_t i = begin; i < end; ++i)
      if (std::abs(response[centre + i - kHalf]) > sigma) beyond += window[i];
    densities.push_back(variance > 0 ? beyond / gaussian : 0);
  }
  return densities;
}

}  // namespace clamor
