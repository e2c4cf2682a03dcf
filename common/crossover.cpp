#include "common/crossover.h"

#include <cmath>
#include <numbers>
#include <span>

#include "common/maths.h"

namespace clamor {

namespace {

double warped(double frequency_hz, double rate_hz) {
  const double angle = std::numbers::pi * frequency_hz / rate_hz;
  return sin_of(angle) / cos_of(angle);
}

template <std::size_t kFactors>
using FilterMemory = std::array<std::array<double, 2>, kFactors>;

// A compile-time number of sections keeps the filter state in registers: twice as fast.
template <class Factors, class Memory>
void run(Factors factors, Memory memory, std::vector<double>& samples, bool backwards,
         std::size_t tail) {
  const std::size_t size = samples.size();
  if (size == 0) return;
  const auto next = [&](double x) {
    for (std::size_t k = 0; k < factors.size(); ++k) {
      const Biquad& factor = factors[k];
      auto& [s1, s2] = memory[k];
      const double y = factor.b0 * x + s1;
      s1 = factor.b1 * x - factor.a1 * y + s2;
      s2 = factor.b2 * x - factor.a2 * y;
      x = y;
    }
    return x;
  };
  // Index of the n-th sample in processing order.
  const auto at = [&](std::size_t n) { return backwards ? size - 1 - n : n; };
  for (std::size_t n = tail; n-- > 0;) next(samples[at(size - 1 - n % size)]);
  for (std::size_t n = 0; n < size; ++n) samples[at(n)] = next(samples[at(n)]);
}

}  // namespace

double band_edge_hz(std::size_t edge) {
  return std::sqrt(kBandCentres_hz[edge] * kBandCentres_hz[edge + 1]);
}

std::array<Biquad, kButterworthFactors> crossover_factors(std::size_t edge, double rate_hz,
                                                          Side side) {
  const double k = warped(band_edge_hz(edge), rate_hz);
  std::array<Biquad, kButterworthFactors> factors;
  for (std::size_t i = 0; i < kButterworthFactors; ++i) {
    const double angle = std::numbers::pi * static_cast<double>(2 * i + 1) /
                         static_cast<double>(4 * kButterworthFactors);
    const double q = 1 / (2 * cos_of(angle));
    const double scale = 1 / (1 + k / q + k * k);
    const double a1 = 2 * (k * k - 1) * scale, a2 = (1 - k / q + k * k) * scale;
    if (side == Side::kLow) factors[i] = {k * k * scale, 2 * k * k * scale, k * k * scale, a1, a2};
    if (side == Side::kHigh) factors[i] = {scale, -2 * scale, scale, a1, a2};
    if (side == Side::kBoth) factors[i] = {a2, a1, 1, a1, a2};
  }
  return factors;
}

double crossover_magnitude(std::size_t edge, double rate_hz, Side side, double frequency_hz) {
  const double w = warped(frequency_hz, rate_hz) / warped(band_edge_hz(edge), rate_hz);
  double power = 1;
  for (std::size_t f = 0; f < kButterworthFactors; ++f) power *= w * w * w * w;
  if (side == Side::kBoth) return 1;
  // Written so that neither side becomes infinity over infinity near the Nyquist frequency.
  return side == Side::kLow ? 1 / (1 + power) : 1 / (1 + 1 / power);
}

void filter_samples(const std::vector<Biquad>& factors, std::vector<double>& samples,
                    bool backwards, std::size_t tail) {
  if (factors.size() == 1)  // the prefilter of a spline
    run(std::span(factors).first<1>(), FilterMemory<1>(), samples, backwards, tail);
  else if (factors.size() == kButterworthFactors)
    run(std::span(factors).first<kButterworthFactors>(), FilterMemory<kButterworthFactors>(),
        samples, backwards, tail);
  else
    run(std::span(factors), std::vector<std::array<double, 2>>(factors.size()), samples, backwards,
        tail);
}

}  // namespace clamor
