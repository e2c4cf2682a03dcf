#include "common/fourier.h"

#include <bit>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

namespace clamor {

Fourier::Fourier(std::size_t size) : order_(size), twiddles_(size) {
  assert(std::has_single_bit(size));
  for (std::size_t i = 1; i < size; ++i)
    order_[i] = order_[i / 2] / 2 + (i % 2 == 1 ? size / 2 : 0);
  for (std::size_t half = 1; half < size; half *= 2)
    for (std::size_t k = 0; k < half; ++k)
      twiddles_[half + k] =
          std::polar(1.0, -std::numbers::pi * static_cast<double>(k) / static_cast<double>(half));
}

void Fourier::forward(std::span<std::complex<double>> values) const {
  assert(values.size() == size());
  for (std::size_t i = 0; i < size(); ++i)
    if (i < order_[i]) std::swap(values[i], values[order_[i]]);
  for (std::size_t half = 1; half < size(); half *= 2) {
    const std::complex<double>* const w = &twiddles_[half];
    for (std::size_t start = 0; start < size(); start += 2 * half) {
      std::complex<double>*const low = &values[start], *const high = low + half;
      for (std::size_t k = 0; k < half; ++k) {
        // Written out because operator* of std::complex checks for NaN.
        const std::complex<double> turned(
            high[k].real() * w[k].real() - high[k].imag() * w[k].imag(),
            high[k].real() * w[k].imag() + high[k].imag() * w[k].real());
        high[k] = low[k] - turned;
        low[k] += turned;
      }
    }
  }
}

void Fourier::inverse(std::span<std::complex<double>> values) const {
  for (auto& value : values) value = std::conj(value);
  forward(values);
  const double scale = 1 / static_cast<double>(size());
  for (auto& value : values) value = std::conj(value) * scale;
}

}  // namespace clamor
