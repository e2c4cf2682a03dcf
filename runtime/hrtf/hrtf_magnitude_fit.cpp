#include "runtime/hrtf/hrtf_magnitude_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/cholesky.h"

namespace clamor {

namespace {

constexpr double kStep_hz = 6, kMinAudible = 1e-5;
constexpr int kFitTurns = 60, kOctaveTurns = 20, kNewtonSteps = 40;
constexpr double kDamping = 0.003, kMaxChange = 0.3, kMaxWeight = 100;
constexpr double kFairMiss = 0.04;   // 0.35 dB
constexpr double kGoodMiss = 0.005;  // of energy: 0.02 dB, below which further steps are inaudible

// Octave gains as the octave buses distribute them to the HRTF bands.
std::array<double, kHrtfBands> at_nodes(const std::array<double, kBandCount>& levels) {
  std::array<double, kHrtfBands> nodes{};
  for (std::size_t bus = 0; bus < kBandCount; ++bus) {
    double gain = 0;
    for (std::size_t c = 0; c < kBandCount; ++c)
      gain += HrtfFilters::bus_gains()[bus][c] * levels[c];
    for (std::size_t j = 0; j < kHrtfBands; ++j)
      nodes[j] += gain * static_cast<double>(HrtfFilters::octave_share(bus, j));
  }
  return nodes;
}

}  // namespace

HrtfMagnitudeFit::HrtfMagnitudeFit() : forms_(kErbBandCount) {
  for (std::size_t j = 0; j < kHrtfBands; ++j) first_[j] = j;
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    Form& form = forms_[b];
    const double low_hz = erb_frequency_hz(static_cast<double>(b) + 1);
    const double high_hz = erb_frequency_hz(static_cast<double>(b) + 2);
    const int count = 1 + static_cast<int>((high_hz - low_hz) / kStep_hz);
    form.first = kHrtfBands;
    std::array<double, kHrtfBands> heard{};
    for (int i = 0; i < count; ++i) {
      const double frequency_hz = low_hz + (high_hz - low_hz) * (i + 0.5) / count;
      std::array<double, kHrtfBands> magnitude{};
      for (std::size_t j = 0; j < kHrtfBands; ++j)
        magnitude[j] = HrtfFilters::magnitude(j, frequency_hz);
      for (std::size_t j = 0; j < kHrtfBands; ++j)
        for (std::size_t k = 0; k < kHrtfBands; ++k)
          form.q[j][k] += magnitude[j] * magnitude[k] / count;
    }
    double sum = 0;
    for (std::size_t j = 0; j < kHrtfBands; ++j) {
      heard[j] = form.q[j][j];
      sum += heard[j];
      if (heard[j] < kMinAudible) continue;
      form.first = std::min(form.first, j);
      form.end = j + 1;
    }
    for (std::size_t j = form.first; j < form.end; ++j) {
      share_[j][b] = heard[j] / sum;
      first_[j] = std::min(first_[j], form.first);
    }
  }
  for (auto& row : share_) {
    double sum = 0;
    for (const double share : row) sum += share;
    for (double& share : row) share /= std::max(sum, 1e-9);
  }
}

ErbBands HrtfMagnitudeFit::energy_of(const Levels& levels, const Forms& forms) {
  ErbBands energy{};
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    const Form& form = forms[b];
    for (std::size_t j = form.first; j < form.end; ++j)
      for (std::size_t k = form.first; k < form.end; ++k)
        energy[b] += levels[j] * form.q[j][k] * levels[k];
  }
  return energy;
}

double HrtfMagnitudeFit::largest_log_miss(const ErbBands& energy, const Forms& forms,
                                          const Levels& levels) {
  const ErbBands now = energy_of(levels, forms);
  double most = 0;
  for (std::size_t b = 0; b < kErbBandCount; ++b)
    most = std::max(most, std::abs(std::log(energy[b] / now[b])));
  return most;
}

double HrtfMagnitudeFit::largest_miss_db(const ErbBands& energy, const Forms& forms,
                                         const HrtfGains& levels) {
  Levels at;
  std::ranges::copy(levels, at.begin());
  return 10 / std::numbers::ln10 * largest_log_miss(energy, forms, at);
}

void HrtfMagnitudeFit::by_turns(const ErbBands& energy, const Forms& forms, Levels& levels) const {
  for (int turn = 0; turn < kFitTurns; ++turn) {
    const ErbBands now = energy_of(levels, forms);
    std::array<double, kHrtfBands> miss{};
    for (std::size_t b = 0; b < kErbBandCount; ++b) {
      const double log_miss = 0.5 * std::log(energy[b] / now[b]);
      for (std::size_t j = forms[b].first; j < forms[b].end; ++j)
        miss[j] += share_[j][b] * log_miss;
    }
    for (std::size_t j = 0; j < kHrtfBands; ++j)
      levels[j] *= std::exp(std::clamp(0.8 * miss[j], -0.5, 0.5));
  }
}

// Steps (J'J + damping) d = J' residual, with each level in units of `scale`.
void HrtfMagnitudeFit::by_newton(const ErbBands& energy, const Forms& forms, const Levels& scale,
                                 Levels& levels) const {
  const auto largest_miss = [&](const Levels& at) { return largest_log_miss(energy, forms, at); };
  ErbBands weight;
  weight.fill(1);
  Levels best = levels;
  double min_miss = largest_miss(levels);
  for (int step = 0; step < kNewtonSteps; ++step) {
    std::array<std::array<double, kHrtfBands>, kHrtfBands> a{};
    Levels d{}, unit{};
    for (std::size_t j = 0; j < kHrtfBands; ++j) {
      unit[j] = std::max(std::abs(levels[j]), scale[j]);
      a[j][j] = kDamping;
    }
    for (std::size_t b = 0; b < kErbBandCount; ++b) {
      const Form& form = forms[b];
      Levels slope{};
      double now = 0;
      for (std::size_t j = form.first; j < form.end; ++j) {
        for (std::size_t k = form.first; k < form.end; ++k) slope[j] += form.q[j][k] * levels[k];
        now += slope[j] * levels[j];
      }
      const double miss = 0.5 * std::log(energy[b] / now);
      for (std::size_t j = form.first; j < form.end; ++j) slope[j] *= unit[j] / now;
      if (std::abs(miss) > kFairMiss) weight[b] = std::min(1.3 * weight[b], kMaxWeight);
      for (std::size_t j = form.first; j < form.end; ++j) {
        d[j] += weight[b] * slope[j] * miss;
        for (std::size_t k = form.first; k <= j; ++k) a[j][k] += weight[b] * slope[j] * slope[k];
      }
    }
    solve_positive_definite(a, d, first_);
    for (std::size_t j = 0; j < kHrtfBands; ++j)
      levels[j] += std::clamp(d[j], -kMaxChange, kMaxChange) * unit[j];
    if (const double miss = largest_miss(levels); miss < min_miss) {
      min_miss = miss;
      best = levels;
      if (min_miss < kGoodMiss) break;
    }
  }
  levels = best;
}

HrtfGains HrtfMagnitudeFit::levels_for(const ErbBands& energy, const Forms& forms) const {
  Levels levels{}, scale{};
  for (std::size_t j = 0; j < kHrtfBands; ++j) {
    double log_level = 0;
    for (std::size_t b = 0; b < kErbBandCount; ++b)
      log_level += share_[j][b] * 0.5 * std::log(energy[b]);
    levels[j] = std::exp(log_level);
    scale[j] = 0.1 * levels[j];
  }
  by_turns(energy, forms, levels);
  by_newton(energy, forms, scale, levels);
  HrtfGains result;
  std::ranges::transform(levels, result.begin(), [](double x) { return static_cast<float>(x); });
  return result;
}

ErbBands HrtfMagnitudeFit::octave_energy_of(const Bands& levels, const Forms& forms) {
  std::array<double, kBandCount> octaves;
  std::ranges::copy(levels, octaves.begin());
  return energy_of(at_nodes(octaves), forms);
}

Bands HrtfMagnitudeFit::octaves_for(const ErbBands& energy, const Forms& forms) const {
  const auto means = [](const ErbBands& bands) {
    std::array<double, kBandCount> sums{}, counts{};
    for (std::size_t b = 0; b < kErbBandCount; ++b) {
      const double octave = std::round(std::log2(erb_band_centre_hz(b) / 1000) + 4);
      const auto c = static_cast<std::size_t>(std::clamp(octave, 0.0, kBandCount - 1.0));
      sums[c] += bands[b];
      counts[c] += 1;
    }
    for (std::size_t c = 0; c < kBandCount; ++c) sums[c] /= counts[c];
    return sums;
  };
  const std::array<double, kBandCount> wanted = means(energy);
  std::array<double, kBandCount> levels{};
  for (std::size_t c = 0; c < kBandCount; ++c) levels[c] = std::sqrt(wanted[c]);
  for (int turn = 0; turn < kOctaveTurns; ++turn) {
    const std::array<double, kBandCount> now = means(energy_of(at_nodes(levels), forms));
    for (std::size_t c = 0; c < kBandCount; ++c)
      levels[c] *= std::clamp(std::pow(wanted[c] / now[c], 0.4), 0.7, 1.4);
  }
  Bands result;
  std::ranges::transform(levels, result.begin(), [](double x) { return static_cast<float>(x); });
  return result;
}

}  // namespace clamor
