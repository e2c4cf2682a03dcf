#include "runtime/hrtf/interaural_times.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/hrtf/erb_bands.h"

namespace clamor {

namespace {

using Spectrum = std::vector<std::complex<double>>;

constexpr double kMaxDetour_s = 1e-3;
constexpr double kLowFrom_hz = 90, kLowTo_hz = 850, kHighFrom_hz = 1400, kHighTo_hz = 12000;
constexpr double kFarthest_s = 0.4e-3;  // between the ITDs of the high and the low layer
constexpr double kFineStep_s = 5e-6;
// A phase may be off by this time or this share of the ITD, whichever is larger.
constexpr double kMinTolerance_s = 20e-6, kToleranceShare = 0.05;

// A range of a cross-spectrum with bins `bin_hz` apart.
struct Part {
  std::size_t first = 0, end = 0;  // bins
  double bin_hz = 0;

  Part(double from_hz, double to_hz, double bin)
      : first(static_cast<std::size_t>(from_hz / bin + 0.5)),
        end(static_cast<std::size_t>(to_hz / bin + 0.5)),
        bin_hz(bin) {}

  std::complex<double> correlation(const Spectrum& cross, double lag_s) const {
    const double angle = -2 * std::numbers::pi * bin_hz * lag_s;
    const std::complex<double> turn = std::polar(1.0, angle);
    std::complex<double> at = std::polar(1.0, angle * static_cast<double>(first)), sum = 0;
    for (std::size_t k = first; k < end; ++k) {
      sum += cross[k] * at;
      at = {at.real() * turn.real() - at.imag() * turn.imag(),
            at.real() * turn.imag() + at.imag() * turn.real()};
    }
    return sum;
  }
};

// Lag with the largest value(correlation) within `reach_s` of `near_s`: first among the samples of
// the inverse transform, then in fine steps, then on a parabola.
template <class Value>
double greatest_s(const Fourier& fourier, const Part& part, const Spectrum& cross, double near_s,
                  double reach_s, const Value& value) {
  const std::size_t size = fourier.size();
  const double step_s = 1 / (part.bin_hz * static_cast<double>(size));
  Spectrum correlation(size);
  for (std::size_t k = part.first; k < part.end; ++k) correlation[k] = std::conj(cross[k]);
  fourier.inverse(correlation);  // of the conjugate, so that positive lags start at sample 0
  double best = -1e300, lag_s = near_s;
  const auto last = static_cast<int>(std::floor((near_s + reach_s) / step_s));
  for (auto i = static_cast<int>(std::ceil((near_s - reach_s) / step_s)); i <= last; ++i) {
    const double here = value(correlation[(static_cast<std::size_t>(i) + size) % size]);
    if (here <= best) continue;
    best = here;
    lag_s = i * step_s;
  }
  const auto steps = static_cast<int>(std::ceil(step_s / kFineStep_s)) + 1;
  std::vector<double> fine;
  for (int i = -steps; i <= steps; ++i)
    fine.push_back(value(part.correlation(cross, lag_s + i * kFineStep_s)));
  const auto top = std::max_element(fine.begin() + 1, fine.end() - 1);
  const double bend = 2 * top[0] - top[-1] - top[1];
  const double between = bend > 0 ? std::clamp((top[1] - top[-1]) / (2 * bend), -0.5, 0.5) : 0;
  return lag_s + (static_cast<double>(top - fine.begin()) - steps + between) * kFineStep_s;
}

}  // namespace

InterauralTimes interaural_times(const Fourier& fourier, double rate_hz, std::size_t frames,
                                 const Spectrum& left, const Spectrum& right) {
  const double bin_hz = rate_hz / static_cast<double>(fourier.size());
  const std::size_t half = fourier.size() / 2;
  Spectrum cross(half), equal(half);
  for (std::size_t k = 0; k < half; ++k) {
    cross[k] = left[k] * std::conj(right[k]);
    equal[k] = cross[k] / std::max(std::abs(cross[k]), 1e-300);
  }
  InterauralTimes times;
  times.low_s = greatest_s(fourier, Part(kLowFrom_hz, kLowTo_hz, bin_hz), equal, 0, kMaxDetour_s,
                           [](std::complex<double> c) { return c.real(); });
  times.high_s = greatest_s(fourier, Part(kHighFrom_hz, kHighTo_hz, bin_hz), cross, times.low_s,
                            kFarthest_s, [](std::complex<double> c) { return std::abs(c); });
  for (std::size_t b = 0; b < kPhaseBands; ++b) {
    const double low_hz = erb_frequency_hz(static_cast<double>(b) + 1);
    const double high_hz = erb_frequency_hz(static_cast<double>(b) + 2);
    const double centre_hz = erb_band_centre_hz(b), per_second = 2 * std::numbers::pi * centre_hz;
    const Part part(low_hz, high_hz, bin_hz);
    double left_energy = 0, right_energy = 0;
    for (std::size_t k = part.first; k < part.end; ++k) {
      left_energy += std::norm(left[k]);
      right_energy += std::norm(right[k]);
    }
    const std::complex<double> sum = part.correlation(cross, times.low_s);
    InterauralTimes::Phase& phase = times.phases[b];
    phase.radians = std::arg(sum);
    const double time_s = times.low_s + phase.radians / per_second;
    phase.max_radians = per_second * std::max(kMinTolerance_s, kToleranceShare * std::abs(time_s));
    phase.is_defined = centre_hz * static_cast<double>(frames) >= rate_hz &&
                       std::abs(sum) >= kMinCoherence * std::sqrt(left_energy * right_energy);
  }
  return times;
}

}  // namespace clamor
