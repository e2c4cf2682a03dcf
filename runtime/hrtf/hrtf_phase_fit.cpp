#include "runtime/hrtf/hrtf_phase_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/cholesky.h"
#include "common/crossover.h"
#include "runtime/hrtf/erb_bands.h"

namespace clamor {

namespace {

constexpr double kPhaseStep_hz = 6, kPhaseLeastHeard = 1e-5, kDifference = 1e-3;
constexpr int kPhaseNewtonSteps = 12;
constexpr double kMaxPhase = 1.4;
constexpr double kPhaseDamping = 0.01;  // relative to the phase of 20 us at a node
constexpr double kDamped_s = 20e-6;
constexpr double kPhaseFairMiss = 0.5, kPhaseMaxWeight = 30;  // relative to a band's tolerance

}  // namespace

HrtfPhaseFit::HrtfPhaseFit() {
  for (std::size_t b = 0; b < kBandsHere; ++b) {
    const double low_hz = erb_frequency_hz(static_cast<double>(b) + 1);
    const double high_hz = erb_frequency_hz(static_cast<double>(b) + 2);
    const int count = 1 + static_cast<int>((high_hz - low_hz) / kPhaseStep_hz);
    std::array<std::array<double, kParts>, kParts> products{};
    for (int i = 0; i < count; ++i) {
      const double frequency_hz = low_hz + (high_hz - low_hz) * (i + 0.5) / count;
      std::array<double, kParts> heard{};
      for (std::size_t j = 0; j < kHrtfLowBands; ++j)
        heard[j] = HrtfFilters::magnitude(j, frequency_hz);
      for (std::size_t k = 0; k < kHrtfQuadratures; ++k)
        heard[kHrtfLowBands + k] = HrtfFilters::quadrature_magnitude(k, frequency_hz);
      for (std::size_t h = 0; h < kHighHere; ++h)
        heard[kHrtfLowRows + h] = HrtfFilters::magnitude(kHrtfLowBands + h, frequency_hz);
      for (std::size_t j = 0; j < kParts; ++j)
        for (std::size_t k = 0; k < kParts; ++k) products[j][k] += heard[j] * heard[k] / count;
    }
    Form& form = forms_[b];
    form.share_of_parting = erb_band_centre_hz(b) / band_edge_hz(kLowBands - 1);
    for (std::size_t j = 0; j < kParts; ++j)
      if (products[j][j] > kPhaseLeastHeard) form.parts.push_back(j);
    for (const std::size_t j : form.parts)
      for (const std::size_t k : form.parts) form.products.push_back(products[j][k]);
  }
}

// Below the first node phase is proportional to frequency, as for a delay; above the last node it
// is constant.
std::array<double, kHrtfLowBands> HrtfPhaseFit::at_bands(const Phases& phases) {
  std::array<double, kHrtfLowBands> at;
  for (std::size_t j = 0; j < kHrtfLowBands; ++j) {
    const double hz = kHrtfNodes_hz[j];
    const auto next = std::ranges::upper_bound(kQuadratureNodes_hz, hz);
    const auto above = static_cast<std::size_t>(next - kQuadratureNodes_hz.begin());
    const double from_hz = above == 0 ? 0 : kQuadratureNodes_hz[above - 1];
    const double from = above == 0 ? 0 : phases[above - 1];
    at[j] = above == kHrtfQuadratures
                ? from
                : from + (phases[above] - from) * (hz - from_hz) / (*next - from_hz);
  }
  return at;
}

HrtfGains HrtfPhaseFit::in_phase(const HrtfGains& levels, const Phases& phases) {
  HrtfGains in_phase = levels;
  const auto at = at_bands(phases);
  for (std::size_t j = 0; j < kHrtfLowBands; ++j)
    in_phase[j] *= static_cast<float>(std::cos(at[j]));
  return in_phase;
}

QuadratureGains HrtfPhaseFit::across(const HrtfGains& levels, const Phases& phases,
                                     std::size_t ear) {
  QuadratureGains across = HrtfFilters::at_quadratures(levels);
  for (std::size_t k = 0; k < kHrtfQuadratures; ++k)
    across[k] *= static_cast<float>(std::sin(ear == 0 ? phases[k] : -phases[k]));
  return across;
}

HrtfPhaseFit::Ear HrtfPhaseFit::ear_of(const HrtfGains& levels, const Phases& phases,
                                       std::size_t ear) {
  Ear parts;
  const HrtfGains bands = in_phase(levels, phases);
  const QuadratureGains quadratures = across(levels, phases, ear);
  for (std::size_t j = 0; j < kHrtfLowBands; ++j) parts[j] = static_cast<double>(bands[j]);
  for (std::size_t k = 0; k < kHrtfQuadratures; ++k)
    parts[kHrtfLowBands + k] = {0, static_cast<double>(quadratures[k])};
  for (std::size_t h = 0; h < kHighHere; ++h)
    parts[kHrtfLowRows + h] = static_cast<double>(bands[kHrtfLowBands + h]);
  return parts;
}

// Sum over an ERB band of one ear's spectrum times the conjugate of the other's, with each high
// layer rotated.
std::complex<double> HrtfPhaseFit::sum_over(std::size_t band, const Ear& one, const Ear& other,
                                            double one_phase, double other_phase) const {
  const Form& form = forms_[band];
  // Half of the phase between the layers at this frequency.
  const auto heard_of = [&](const Ear& ear, std::size_t part, double phase) {
    return part < kHrtfLowRows ? ear[part]
                               : ear[part] * std::polar(1.0, phase * form.share_of_parting);
  };
  const double* product = form.products.data();
  std::complex<double> sum = 0;
  for (const std::size_t j : form.parts) {
    std::complex<double> heard = 0;
    for (const std::size_t k : form.parts) heard += *product++ * heard_of(other, k, other_phase);
    sum += heard_of(one, j, one_phase) * std::conj(heard);
  }
  return sum;
}

HrtfPhaseFit::Misses HrtfPhaseFit::misses(const std::array<HrtfGains, kEars>& levels,
                                          const Phases& phases, double high_phase,
                                          const Wanted& wanted) const {
  const Ear left = ear_of(levels[0], phases, 0), right = ear_of(levels[1], phases, 1);
  Misses misses{};
  for (std::size_t b = 0; b < kPhaseBands; ++b) {
    if (!wanted[b].is_defined) continue;
    const std::complex<double> sum = sum_over(b, left, right, high_phase, -high_phase);
    misses[b] = std::arg(sum * std::polar(1.0, -wanted[b].radians)) / wanted[b].max_radians;
  }
  return misses;
}

// Each band of the low layer becomes a column of in-phase and quadrature parts.
void HrtfPhaseFit::turn(const Phases& phases, double high_phase,
                        HrtfMagnitudeFit::Forms& forms) const {
  std::array<Ear, kHere> columns;
  for (std::size_t j = 0; j < kHere; ++j) {
    HrtfGains one{};
    one[j] = 1;
    columns[j] = ear_of(one, phases, 0);
  }
  for (std::size_t b = 0; b < kBandsHere; ++b) {
    HrtfMagnitudeFit::Form& form = forms[b];
    for (std::size_t j = form.first; j < std::min(form.end, kHere); ++j)
      for (std::size_t k = form.first; k <= j; ++k)
        form.q[j][k] = form.q[k][j] =
            sum_over(b, columns[j], columns[k], high_phase, high_phase).real();
  }
}

// Half of the wanted phase, interpolated between the centres of the defined ERB bands.
HrtfPhaseFit::Phases HrtfPhaseFit::first_guess(const Wanted& wanted) {
  Phases phases{};
  for (std::size_t k = 0; k < kHrtfQuadratures; ++k) {
    double from_hz = 0, from = 0, to_hz = 0, to = 0;
    for (std::size_t b = 0; b < kPhaseBands && to_hz < kQuadratureNodes_hz[k]; ++b) {
      if (!wanted[b].is_defined) continue;
      from_hz = std::exchange(to_hz, erb_band_centre_hz(b));
      from = std::exchange(to, 0.5 * wanted[b].radians);
    }
    const double share =
        to_hz > from_hz ? (kQuadratureNodes_hz[k] - from_hz) / (to_hz - from_hz) : 0;
    phases[k] = from + std::min(share, 1.0) * (to - from);
  }
  return phases;
}

double HrtfPhaseFit::largest_miss(const std::array<HrtfGains, kEars>& levels, const Phases& phases,
                                  const Wanted& wanted, double high_phase) const {
  double max_miss = 0;
  for (const double miss : misses(levels, phases, high_phase, wanted))
    max_miss = std::max(max_miss, std::abs(miss));
  return max_miss;
}

HrtfPhaseFit::Phases HrtfPhaseFit::phases_for(const std::array<HrtfGains, kEars>& levels,
                                              const Wanted& wanted, double high_phase) const {
  constexpr std::size_t kNodes = kHrtfQuadratures;
  const Phases guess = first_guess(wanted);
  Phases phases = guess, best{};
  double min_miss = 1e300;
  std::array<double, kPhaseBands> weight;
  weight.fill(1);
  for (int step = 0; step <= kPhaseNewtonSteps; ++step) {
    const Misses now = misses(levels, phases, high_phase, wanted);
    double max_miss = 0;
    for (std::size_t b = 0; b < kPhaseBands; ++b) {
      max_miss = std::max(max_miss, std::abs(now[b]));
      if (std::abs(now[b]) > kPhaseFairMiss) weight[b] = std::min(1.5 * weight[b], kPhaseMaxWeight);
    }
    if (max_miss < min_miss) {
      min_miss = max_miss;
      best = phases;
    }
    std::array<Misses, kNodes> slope;
    for (std::size_t k = 0; k < kNodes; ++k) {
      Phases moved = phases;
      moved[k] += kDifference;
      slope[k] = misses(levels, moved, high_phase, wanted);
      for (std::size_t b = 0; b < kPhaseBands; ++b)
        slope[k][b] = (slope[k][b] - now[b]) / kDifference;
    }
    std::array<std::array<double, kNodes>, kNodes> a{};
    std::array<double, kNodes> d{};
    for (std::size_t j = 0; j < kNodes; ++j) {
      const double unit = 2 * std::numbers::pi * kQuadratureNodes_hz[j] * kDamped_s;
      a[j][j] = kPhaseDamping / (unit * unit);
      d[j] = kPhaseDamping / (unit * unit) * (guess[j] - phases[j]);
      for (std::size_t b = 0; b < kPhaseBands; ++b) {
        d[j] -= weight[b] * slope[j][b] * now[b];
        for (std::size_t k = 0; k <= j; ++k) a[j][k] += weight[b] * slope[j][b] * slope[k][b];
      }
    }
    solve_positive_definite(a, d);
    for (std::size_t j = 0; j < kNodes; ++j)
      phases[j] = std::clamp(phases[j] + d[j], -kMaxPhase, kMaxPhase);
  }
  return best;
}

}  // namespace clamor
