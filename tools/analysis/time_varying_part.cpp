#include "tools/analysis/time_varying_part.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <complex>
#include <vector>

#include "common/fourier.h"
#include "common/sample_rate.h"

namespace clamor {

namespace {

using Complex = std::complex<double>;
using Row = std::vector<Complex>;

constexpr double kFloor = 1e-6;  // of the energy; fainter parts are inaudible
constexpr int kMaxSteps = 200;
constexpr double kConverged = 1e-4;  // of the residual, per step
constexpr int kConvergedSteps = 5;   // in succession
// Least power in the preconditioner, relative to the mean over frequencies.
constexpr double kMinPower = 1e-6;

Complex product(const Complex& a, const Complex& b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

Complex conjugate_product(const Complex& a, const Complex& b) { return product(std::conj(a), b); }

// Two real channels are the real and imaginary part of one complex signal. As x is real, the two
// problems stay separate except for the step sizes, which minimise the sum of both errors.
class FixedFilterFit {
 public:
  FixedFilterFit(std::span<const float> dry, const Sound& rendering, std::size_t taps)
      : taps_(taps),
        frames_(rendering.frames()),
        whole_(std::bit_ceil(frames_)),
        short_(std::bit_ceil(2 * taps)),
        spectrum_(whole_.size()) {
    for (std::size_t n = 0; n < std::min(frames_, dry.size()); ++n)
      spectrum_[n] = static_cast<double>(dry[n]);
    whole_.forward(spectrum_);
    make_preconditioner();
    residual_.assign(frames_ - first(), {});
    for (std::size_t n = first(); n < frames_; ++n)
      residual_[n - first()] = {sample(rendering, 0, n), sample(rendering, 1, n)};
  }

  std::array<double, 2> energies() const {
    std::array<double, 2> sums{};
    for (const Complex& value : residual_) {
      sums[0] += value.real() * value.real();
      sums[1] += value.imag() * value.imag();
    }
    return sums;
  }

  void solve() {
    Row gradient = correlate(residual_);
    Row scaled = preconditioned(gradient), direction = scaled;
    double slope = inner(gradient, scaled);
    double energy = energies()[0] + energies()[1];
    const double enough = kFloor * energy;
    int small_steps = 0;
    for (int step = 0; step < kMaxSteps && energy > enough && small_steps < kConvergedSteps;
         ++step) {
      const Row filtered = filter(direction);
      const double curvature = inner(filtered, filtered);
      if (!(slope > 0 && curvature > 0)) return;
      const double length = slope / curvature;
      for (std::size_t n = 0; n < residual_.size(); ++n) residual_[n] -= length * filtered[n];
      const double left = energies()[0] + energies()[1];
      small_steps = energy - left < kConverged * energy ? small_steps + 1 : 0;
      energy = left;
      gradient = correlate(residual_);
      scaled = preconditioned(gradient);
      const double next = inner(gradient, scaled);
      for (std::size_t k = 0; k < taps_; ++k)
        direction[k] = scaled[k] + next / slope * direction[k];
      slope = next;
    }
  }

  double fitted_share() const {
    return static_cast<double>(taps_) / static_cast<double>(residual_.size());
  }

 private:
  std::size_t first() const { return taps_ - 1; }

  static double sample(const Sound& sound, std::size_t channel, std::size_t n) {
    return channel < sound.channels.size() ? static_cast<double>(sound.channels[channel][n]) : 0;
  }

  static double inner(const Row& a, const Row& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      sum += a[i].real() * b[i].real() + a[i].imag() * b[i].imag();
    return sum;
  }

  // (h * x)[n] from first() on; wrapped samples lie before it.
  Row filter(const Row& taps) const {
    Row values(whole_.size());
    std::copy(taps.begin(), taps.end(), values.begin());
    whole_.forward(values);
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = product(values[k], spectrum_[k]);
    whole_.inverse(values);
    return {values.begin() + static_cast<std::ptrdiff_t>(first()),
            values.begin() + static_cast<std::ptrdiff_t>(frames_)};
  }

  // The transpose of filter().
  Row correlate(const Row& residual) const {
    Row values(whole_.size());
    std::copy(residual.begin(), residual.end(),
              values.begin() + static_cast<std::ptrdiff_t>(first()));
    whole_.forward(values);
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = conjugate_product(spectrum_[k], values[k]);
    whole_.inverse(values);
    values.resize(taps_);
    return values;
  }

  // The power spectrum of x from its tapered autocorrelation, up to the number of taps.
  void make_preconditioner() {
    Row power(whole_.size());
    for (std::size_t k = 0; k < power.size(); ++k) power[k] = std::norm(spectrum_[k]);
    whole_.inverse(power);
    Row autocorrelation(short_.size());
    for (std::size_t k = 0; k < taps_; ++k) {
      const double taper = 1 - static_cast<double>(k) / static_cast<double>(taps_);
      autocorrelation[k] = taper * power[k].real();
      if (k > 0) autocorrelation[autocorrelation.size() - k] = autocorrelation[k];
    }
    short_.forward(autocorrelation);
    double mean = 0;
    for (const Complex& value : autocorrelation)
      mean += value.real() / static_cast<double>(autocorrelation.size());
    inverse_power_.resize(autocorrelation.size());
    for (std::size_t k = 0; k < autocorrelation.size(); ++k)
      inverse_power_[k] = 1 / std::max(autocorrelation[k].real(), kMinPower * mean);
  }

  Row preconditioned(const Row& gradient) const {
    Row values(short_.size());
    std::copy(gradient.begin(), gradient.end(), values.begin());
    short_.forward(values);
    for (std::size_t k = 0; k < values.size(); ++k) values[k] *= inverse_power_[k];
    short_.inverse(values);
    values.resize(taps_);
    return values;
  }

  const std::size_t taps_, frames_;
  const Fourier whole_, short_;
  Row spectrum_;  // of x
  std::vector<double> inverse_power_;
  Row residual_;
};

}  // namespace

std::array<std::optional<double>, 2> time_varying_part_db(std::span<const float> dry,
                                                          const Sound& rendering, double filter_s) {
  const auto taps = static_cast<std::size_t>(filter_s * kSampleRate_hz);
  assert(taps > 0);
  const auto is_silent = [](std::span<const float> samples) {
    return std::all_of(samples.begin(), samples.end(), [](float x) { return x == 0; });
  };
  if (rendering.frames() < 4 * taps || is_silent(dry)) return {};
  FixedFilterFit fit(dry, rendering, taps);
  const std::array<double, 2> before = fit.energies();
  fit.solve();
  const std::array<double, 2> after = fit.energies();
  std::array<std::optional<double>, 2> parts;
  for (std::size_t c = 0; c < rendering.channels.size(); ++c)
    if (before[c] > 0)
      parts[c] =
          10 * std::log10(std::clamp(after[c] / before[c] / (1 - fit.fitted_share()), kFloor, 1.0));
  return parts;
}

}  // namespace clamor
