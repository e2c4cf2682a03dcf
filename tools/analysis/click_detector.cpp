#include "tools/analysis/click_detector.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "common/sample_rate.h"
#include "tools/analysis/hann_window.h"

namespace clamor {

namespace {

// The result of a fit is used in the middle half of its range.
constexpr std::size_t kFit = 2048, kStep = 1024;
constexpr std::size_t kStretch = 256;  // per median: 5.3 ms
constexpr double kMedianOfGaussian = 0.6745;
constexpr auto kSpacing = static_cast<std::size_t>(kClickSpacing_s * kSampleRate_hz);

// White noise at -90 dB, which keeps the fit of pure tones well conditioned.
constexpr double kWhitening = 1e-9;

std::vector<double> residual_of(std::span<const float> samples) {
  const std::vector<double> window = hann_window(kFit, kFit, 0.5);
  // Zeros on both sides keep every index in range.
  constexpr std::size_t kPad = kFit;
  std::vector<double> padded(samples.size() + 2 * kPad);
  std::copy(samples.begin(), samples.end(), padded.begin() + kPad);

  // Inner loops run over independent sums, so that they are vectorised.
  std::vector<double> residual(samples.size()), stretch(kPredictionOrder + kFit);
  for (std::size_t start = 0; start < samples.size(); start += kStep) {
    const double* const from = &padded[kPad + start - (kFit - kStep) / 2];
    for (std::size_t i = 0; i < kFit; ++i) stretch[kPredictionOrder + i] = window[i] * from[i];
    std::array<double, kPredictionOrder + 1> reversed{};  // by lag, the longest first
    for (std::size_t i = 0; i < kFit; ++i)
      for (std::size_t k = 0; k <= kPredictionOrder; ++k)
        reversed[k] += stretch[kPredictionOrder + i] * stretch[i + k];
    std::array<double, kPredictionOrder + 1> r;
    std::reverse_copy(reversed.begin(), reversed.end(), r.begin());
    r[0] *= 1 + kWhitening;
    const std::vector<double> a = levinson(r);
    const std::size_t count = std::min(samples.size() - start, kStep);
    double* const out = &residual[start];
    std::copy_n(&padded[kPad + start], count, out);
    for (std::size_t k = 0; k < kPredictionOrder; ++k) {
      const double* const past = &padded[kPad + start - 1 - k];
      for (std::size_t i = 0; i < count; ++i) out[i] -= a[k] * past[i];
    }
  }
  return residual;
}

}  // namespace

std::vector<double> levinson(std::span<const double> r) {
  assert(!r.empty());
  const std::size_t order = r.size() - 1;
  std::vector<double> a(order), before(order);
  double error = r[0];
  for (std::size_t m = 0; m < order && error > 0; ++m) {
    double reflection = r[m + 1];
    for (std::size_t k = 0; k < m; ++k) reflection -= a[k] * r[m - k];
    reflection /= error;
    std::copy(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(m), before.begin());
    for (std::size_t k = 0; k < m; ++k) a[k] = before[k] - reflection * before[m - 1 - k];
    a[m] = reflection;
    error *= 1 - reflection * reflection;
  }
  return a;
}

std::vector<Click> find_clicks(std::span<const float> samples, double least) {
  const std::vector<double> residual = residual_of(samples);
  std::vector<double> scale((samples.size() + kStretch - 1) / kStretch), magnitudes;
  for (std::size_t s = 0; s < scale.size(); ++s) {
    const std::size_t begin = s * kStretch, end = std::min(samples.size(), begin + kStretch);
    magnitudes.clear();
    for (std::size_t i = begin; i < end; ++i) magnitudes.push_back(std::abs(residual[i]));
    const auto middle = magnitudes.begin() + static_cast<std::ptrdiff_t>(magnitudes.size() / 2);
    std::nth_element(magnitudes.begin(), middle, magnitudes.end());
    scale[s] = *middle / kMedianOfGaussian;
  }

  std::vector<Click> clicks;
  std::size_t last_outlier = 0;
  for (std::size_t i = kPredictionOrder; i < samples.size(); ++i) {
    const std::size_t s = i / kStretch;
    double sigma = scale[s];
    if (s > 0) sigma = std::max(sigma, scale[s - 1]);
    if (s + 1 < scale.size()) sigma = std::max(sigma, scale[s + 1]);
    sigma = std::max(sigma, least / kClickSigmas);
    const double magnitude = std::abs(residual[i]);
    if (!(magnitude > kClickSigmas * sigma)) continue;
    const Click click{i, magnitude / sigma};
    if (clicks.empty() || i - last_outlier > kSpacing)
      clicks.push_back(click);
    else if (click.sigmas > clicks.back().sigmas)
      clicks.back() = click;
    last_outlier = i;
  }
  return clicks;
}

std::vector<Click> new_clicks(std::span<const Click> clicks, std::span<const Click> known) {
  std::vector<Click> unknown;
  for (const Click& click : clicks) {
    const auto near = std::lower_bound(
        known.begin(), known.end(), click.frame,
        [](const Click& other, std::size_t frame) { return other.frame + kSpacing < frame; });
    if (near == known.end() || near->frame > click.frame + kSpacing) unknown.push_back(click);
  }
  return unknown;
}

}  // namespace clamor
