#include "tools/analysis/texture_statistics.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>

#include "common/fourier.h"
#include "common/sample_rate.h"
#include "runtime/hrtf/erb_bands.h"
#include "tools/analysis/hann_window.h"

namespace clamor {

namespace {

constexpr std::size_t kBlock = 8192;  // 171 ms
constexpr std::size_t kStep = 64;     // envelope values per block
constexpr double kCompression = 0.3, kMin_s = 1.5, kFirstErb = 2;
constexpr std::size_t kModulationFrame = 256;  // envelope values: 1.46 Hz a bin

// A band shifted to 0 Hz and sampled as slowly as its width allows.
struct Band {
  std::size_t first_bin = 0;  // even, so that blocks half their length apart agree in phase
  std::vector<double> gains;
  std::size_t size = 0;  // samples per block

  explicit Band(std::size_t band) {
    const double centre = kFirstErb + static_cast<double>(band),
                 bins_per_hz = double{kBlock} / kSampleRate_hz;
    first_bin = static_cast<std::size_t>(erb_frequency_hz(centre - 1) * bins_per_hz) / 2 * 2;
    const auto end = static_cast<std::size_t>(erb_frequency_hz(centre + 1) * bins_per_hz) + 1;
    for (std::size_t k = first_bin; k < end; ++k) {
      const double away = erb_number(static_cast<double>(k) / bins_per_hz) - centre;
      gains.push_back(std::abs(away) < 1 ? std::cos(std::numbers::pi / 2 * away) : 0);
    }
    size = std::max(std::size_t{kStep}, std::bit_ceil(gains.size()));
  }
};

// Compressed envelopes of all bands.
std::vector<std::vector<double>> envelopes_of(std::span<const float> samples) {
  const Fourier fourier(kBlock);
  const std::vector<double> window = hann_window(kBlock, kBlock);
  std::vector<Band> bands;
  std::vector<Fourier> inverses;
  std::vector<std::vector<std::complex<double>>> begun(kTextureBands);  // by the previous block
  for (std::size_t b = 0; b < kTextureBands; ++b) {
    bands.emplace_back(b);
    inverses.emplace_back(bands[b].size);
    begun[b].resize(bands[b].size / 2);
  }

  const std::size_t count = samples.size() * kStep / kBlock;
  std::vector<std::vector<double>> envelopes(kTextureBands);
  std::vector<std::complex<double>> values(kBlock), narrow;
  for (std::size_t block = 0; envelopes[0].size() < count; ++block) {
    for (std::size_t i = 0; i < kBlock; ++i) {
      const std::size_t at = block * (kBlock / 2) + i - kBlock / 2;  // wraps round before the sound
      values[i] = at < samples.size() ? window[i] * samples[at] : 0;
    }
    fourier.forward(values);
    for (std::size_t b = 0; b < kTextureBands; ++b) {
      const Band& band = bands[b];
      narrow.assign(band.size, 0);
      for (std::size_t k = 0; k < band.gains.size(); ++k)
        narrow[k] = band.gains[k] * values[band.first_bin + k];
      inverses[b].inverse(narrow);
      const double scale = 2 * static_cast<double>(band.size) / kBlock;
      const std::size_t half = band.size / 2, per_value = band.size / kStep;
      for (std::size_t i = 0; block > 0 && i < half && envelopes[b].size() < count;
           i += per_value) {
        double sum = 0;
        for (std::size_t k = i; k < i + per_value; ++k)
          sum += std::pow(scale * std::abs(begun[b][k] + narrow[k]), kCompression);
        envelopes[b].push_back(sum / static_cast<double>(per_value));
      }
      std::copy(narrow.begin() + static_cast<std::ptrdiff_t>(half), narrow.end(), begun[b].begin());
    }
  }
  return envelopes;
}

// Moments about the mean.
struct Moments {
  double mean = 0, second = 0, third = 0, fourth = 0;

  explicit Moments(const std::vector<double>& values) {
    const auto count = static_cast<double>(values.size());
    for (const double v : values) mean += v / count;
    for (const double v : values) {
      const double d = v - mean;
      second += d * d / count;
      third += d * d * d / count;
      fourth += d * d * d * d / count;
    }
  }
};

double correlation_of(const std::vector<double>& a, const std::vector<double>& b) {
  const Moments of_a(a), of_b(b);
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - of_a.mean) * (b[i] - of_b.mean);
  const double scale =
      static_cast<double>(a.size()) * std::sqrt(of_a.second) * std::sqrt(of_b.second);
  return scale > 0 ? sum / scale : 0;
}

// Power per octave of modulation, in dB relative to their sum.
void add_modulation(const std::vector<double>& envelope, const Fourier& fourier,
                    std::vector<double>& modulation_db) {
  const double mean = Moments(envelope).mean;
  const std::vector<double> window = hann_window(kModulationFrame, kModulationFrame);
  std::vector<double> octaves(kModulationBands);
  std::vector<std::complex<double>> values(kModulationFrame);
  for (std::size_t start = 0; start + kModulationFrame <= envelope.size();
       start += kModulationFrame / 2) {
    for (std::size_t i = 0; i < kModulationFrame; ++i)
      values[i] = (envelope[start + i] - mean) * window[i];
    fourier.forward(values);
    for (std::size_t k = 1; k < kModulationFrame / 2; ++k)
      octaves[static_cast<std::size_t>(std::bit_width(k)) - 1] += std::norm(values[k]);
  }
  double whole = 0;
  for (const double power : octaves) whole += power;
  for (const double power : octaves)
    modulation_db.push_back(power > 0 ? 10 * std::log10(power / whole) : 0);
}

}  // namespace

TextureStatistics texture_statistics(std::span<const float> samples) {
  TextureStatistics statistics;
  if (static_cast<double>(samples.size()) < kMin_s * kSampleRate_hz) return statistics;
  const std::vector<std::vector<double>> envelopes = envelopes_of(samples);
  const Fourier fourier(kModulationFrame);
  for (std::size_t b = 0; b < kTextureBands; ++b) {
    const Moments moments(envelopes[b]);
    const bool steady = !(moments.second > 1e-12 * moments.mean * moments.mean);
    statistics.variation.push_back(steady ? 0 : std::sqrt(moments.second) / moments.mean);
    statistics.skewness.push_back(steady ? 0 : moments.third / std::pow(moments.second, 1.5));
    statistics.kurtosis.push_back(steady ? 0 : moments.fourth / (moments.second * moments.second));
    add_modulation(envelopes[b], fourier, statistics.modulation_db);
    if (b + kCorrelationErbs < kTextureBands)
      statistics.correlation.push_back(
          correlation_of(envelopes[b], envelopes[b + kCorrelationErbs]));
  }
  return statistics;
}

}  // namespace clamor
