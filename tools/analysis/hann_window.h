// hann_window.h: the window of J. von Hann, for spectra and moments of sounds.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace clamor {

// sin^2(pi (i + first) / period) for i below `size`. Windows half a period apart add up to 1.
inline std::vector<double> hann_window(std::size_t size, std::size_t period, double first = 0) {
  std::vector<double> window(size);
  for (std::size_t i = 0; i < size; ++i)
    window[i] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(i) + first) /
                                     static_cast<double>(period));
  return window;
}

}  // namespace clamor
