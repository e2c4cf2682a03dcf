#include "runtime/hrtf/hrtf.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>

#include "common/crossover.h"
#include "common/fourier.h"
#include "common/maths.h"
#include "common/parallel_for.h"
#include "common/sample_rate.h"
#include "runtime/hrtf/default_hrtf.h"
#include "runtime/hrtf/erb_bands.h"
#include "runtime/hrtf/hrtf_magnitude_fit.h"
#include "runtime/hrtf/hrtf_phase_fit.h"
#include "runtime/hrtf/interaural_times.h"

namespace clamor {

namespace {

constexpr std::size_t kMinSpectrum = 8192;
constexpr std::size_t kDirectionsTogether = 8;  // directions per task of a thread
constexpr int kTurns = 6, kPhaseTurns = 4;
constexpr double kMinDepth = 0.2;      // no gap is wider than 156 degrees
constexpr double kSteepest_s = 25e-6;  // per degree
constexpr double kGoodFit = 0.6;       // dB, or a fraction of the tolerance of a phase
constexpr double kQuietest = 1e-6;     // 60 dB below the loudest band: silence has no spectrum

using Spectrum = std::vector<std::complex<double>>;

Spectrum spectrum_of(const Fourier& fourier, const float* samples, std::size_t frames) {
  Spectrum spectrum(fourier.size());
  std::copy_n(samples, std::min(frames, spectrum.size()), spectrum.begin());
  fourier.forward(spectrum);
  return spectrum;
}

ErbBands energy_of(const Spectrum& spectrum, double bin_hz) {
  ErbBands energy{};
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    const double low = erb_frequency_hz(static_cast<double>(b) + 1) / bin_hz;
    const double high = erb_frequency_hz(static_cast<double>(b) + 2) / bin_hz;
    const double last = std::min(high + 0.5, static_cast<double>(spectrum.size() / 2));
    for (auto k = static_cast<std::size_t>(low + 0.5); static_cast<double>(k) <= last; ++k) {
      const double at = static_cast<double>(k);
      const double share = std::min(high, at + 0.5) - std::max(low, at - 0.5);
      energy[b] += share * std::norm(spectrum[k]) / (high - low);
    }
  }
  const double min_energy = std::max(kQuietest * *std::ranges::max_element(energy), 1e-30);
  for (double& band : energy) band = std::max(band, min_energy);
  return energy;
}

// Limits the slope of ITDs over direction to kSteepest_s per degree: each becomes the middle of the
// range that all others allow. Sound reaches an ear by more than one path around the head. Where
// two are equally loud, nearly opposite an ear, the measured ITD jumps from one path to the other.
void make_smooth(std::span<const Vec3f> directions, std::vector<InterauralTimes>& times) {
  constexpr double kPerRadian_s = kSteepest_s * 180 / std::numbers::pi;
  std::vector<double> smooth_s;
  for (std::size_t d = 0; d < directions.size(); ++d) {
    double max_s = 1, min_s = -1;
    for (std::size_t k = 0; k < directions.size(); ++k) {
      const float cosine = std::clamp(dot(directions[d], directions[k]), -1.0f, 1.0f);
      const double apart_s = k == d ? 0 : kPerRadian_s * acos_of(static_cast<double>(cosine));
      max_s = std::min(max_s, times[k].high_s + apart_s);
      min_s = std::max(min_s, times[k].high_s - apart_s);
    }
    smooth_s.push_back((max_s + min_s) / 2);
  }
  for (std::size_t d = 0; d < times.size(); ++d) times[d].high_s = smooth_s[d];
}

}  // namespace

Result<std::shared_ptr<const Hrtf>> Hrtf::read(const std::string& path, unsigned threads) {
  if (path.empty()) {
    auto embedded = default_hrtf();
    if (embedded == nullptr)
      return Error("the head inside this build does not fit it; run make_head and build again.");
    return embedded;
  }
  auto responses = read_sofa(path);
  if (!responses.ok()) return responses.error();
  auto head = std::make_shared<const Hrtf>(*responses, threads);
  if (head->directions() == 0)
    return Error(path + ": was not measured from all sides; give a head that was.");
  return head;
}

// Measurements of one direction: energies relative to the mean of all directions, and ITDs.
struct Hrtf::Measured {
  std::array<ErbBands, kEars> energy;
  InterauralTimes times;
};

std::vector<Hrtf::Measured> Hrtf::measure(const HrirSet& responses,
                                          const std::vector<std::size_t>& kept,
                                          const std::vector<Vec3f>& places, unsigned threads) {
  const Fourier fourier(std::max(kMinSpectrum, std::bit_ceil(responses.frames)));
  const double bin_hz = responses.rate_hz / static_cast<double>(fourier.size());
  std::vector<Measured> all(kept.size());
  std::vector<InterauralTimes> times(kept.size());
  parallel_for(kept.size(), kDirectionsTogether, threads, [&](std::size_t first, std::size_t end) {
    for (std::size_t d = first; d < end; ++d) {
      std::array<Spectrum, kEars> ears;
      for (std::size_t e = 0; e < kEars; ++e) {
        ears[e] = spectrum_of(fourier, responses.response(kept[d], e), responses.frames);
        all[d].energy[e] = energy_of(ears[e], bin_hz);
      }
      times[d] = interaural_times(fourier, responses.rate_hz, responses.frames, ears[0], ears[1]);
    }
  });
  make_smooth(places, times);
  ErbBands diffuse{};  // mean over all directions and both ears
  for (const Measured& one : all)
    for (const ErbBands& ear : one.energy)
      for (std::size_t b = 0; b < kErbBandCount; ++b)
        diffuse[b] += ear[b] / static_cast<double>(kEars * kept.size());
  for (std::size_t d = 0; d < all.size(); ++d) {
    all[d].times = times[d];
    for (ErbBands& ear : all[d].energy)
      for (std::size_t b = 0; b < kErbBandCount; ++b) ear[b] /= diffuse[b];
  }
  return all;
}

Hrtf::Direction Hrtf::fitted(const Measured& measured, const HrtfMagnitudeFit& fit,
                             const HrtfPhaseFit& phase_fit) {
  const InterauralTimes& times = measured.times;
  const double low_lag_s = times.low_s - times.high_s;
  Direction direction{};
  direction.itd_frames = static_cast<float>(times.high_s * kSampleRate_hz);
  direction.low_itd_frames = static_cast<float>(low_lag_s * kSampleRate_hz);
  // Phase between the layers at each ear, at the frequency where they meet.
  const double high_phase = -std::numbers::pi * band_edge_hz(kLowBands - 1) * low_lag_s;
  HrtfMagnitudeFit::Forms forms = fit.forms();
  phase_fit.turn({}, high_phase, forms);
  std::array<HrtfGains, kEars> levels;
  for (std::size_t e = 0; e < kEars; ++e) {
    direction.octave[e] = fit.octaves_for(measured.energy[e], forms);
    const ErbBands octaves = HrtfMagnitudeFit::octave_energy_of(direction.octave[e], forms);
    const auto narrow = [](double x) { return static_cast<float>(x); };
    std::ranges::transform(measured.energy[e], direction.energies.measured[e].begin(), narrow);
    std::ranges::transform(octaves, direction.energies.octaves[e].begin(), narrow);
    levels[e] = fit.levels_for(measured.energy[e], forms);
  }
  // Phases depend on levels and levels on phases, so both fits alternate, and the best result is
  // kept.
  double min_miss = 1e300;
  for (int turn = 0; turn < kPhaseTurns && min_miss >= kGoodFit; ++turn) {
    const auto phases = phase_fit.phases_for(levels, times.phases, high_phase);
    phase_fit.turn(phases, high_phase, forms);
    double miss = 0;
    for (std::size_t e = 0; e < kEars; ++e) {
      levels[e] = fit.levels_for(measured.energy[e], forms);
      miss =
          std::max(miss, HrtfMagnitudeFit::largest_miss_db(measured.energy[e], forms, levels[e]));
    }
    miss = std::max(miss, phase_fit.largest_miss(levels, phases, times.phases, high_phase));
    if (miss >= min_miss) continue;
    min_miss = miss;
    for (std::size_t e = 0; e < kEars; ++e) {
      direction.level[e] = HrtfPhaseFit::in_phase(levels[e], phases);
      direction.across[e] = HrtfPhaseFit::across(levels[e], phases, e);
    }
  }
  return direction;
}

Hrtf::Hrtf(const HrirSet& responses, unsigned threads) {
  // A pole may have been measured many times.
  std::vector<std::size_t> kept;
  std::vector<Vec3f>& places = places_;
  for (std::size_t d = 0; d < responses.directions.size(); ++d) {
    const Vec3f& direction = responses.directions[d];
    const bool known = std::any_of(places.begin(), places.end(), [&](const Vec3f& place) {
      return dot(place, direction) > 1 - 1e-7f;
    });
    if (known) continue;
    kept.push_back(d);
    places.push_back(direction);
  }
  mesh_ = std::make_unique<const DirectionMesh>(places);
  if (mesh_->depth() < kMinDepth) return;

  const std::vector<Measured> measured = measure(responses, kept, places, threads);
  const HrtfMagnitudeFit fit;
  const HrtfPhaseFit phase_fit;
  directions_.resize(kept.size());
  parallel_for(kept.size(), kDirectionsTogether, threads, [&](std::size_t first, std::size_t end) {
    for (std::size_t d = first; d < end; ++d) directions_[d] = fitted(measured[d], fit, phase_fit);
  });
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    double sum = 0;
    for (std::size_t j = 0; j < kHrtfBands; ++j) sum += fit.shares()[j][b];
    for (std::size_t j = 0; j < kHrtfBands; ++j) {
      shares_[j][b] = static_cast<float>(fit.shares()[j][b]);
      parts_[b][j] = static_cast<float>(fit.shares()[j][b] / sum);
    }
  }
}

template <class Levels>
std::array<Levels, kEars> Hrtf::between(
    const DirectionMesh::Place& place,
    std::array<Levels, kEars> Direction::*levels) const noexcept REALTIME {
  std::array<Levels, kEars> sum{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& corner = directions_[place.corner[k]].*levels;
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t b = 0; b < sum[e].size(); ++b) sum[e][b] += place.share[k] * corner[e][b];
  }
  return sum;
}

std::array<HrtfGains, kEars> Hrtf::gains(
    const DirectionMesh::Place& place) const noexcept REALTIME {
  return between(place, &Direction::level);
}

std::array<QuadratureGains, kEars> Hrtf::quadrature_gains(
    const DirectionMesh::Place& place) const noexcept REALTIME {
  return between(place, &Direction::across);
}

HrtfGains Hrtf::changed_by(const ErbBands& change) const noexcept REALTIME {
  HrtfGains levels;
  levels.fill(1);
  for (int turn = 0; turn < kTurns; ++turn) {
    std::array<float, kErbBandCount> missing;
    for (std::size_t b = 0; b < kErbBandCount; ++b) {
      float now = 0;
      for (std::size_t j = 0; j < kHrtfBands; ++j) now += parts_[b][j] * levels[j];
      missing[b] = static_cast<float>(change[b]) / now;
    }
    for (std::size_t j = 0; j < kHrtfBands; ++j) {
      float by = 0;
      for (std::size_t b = 0; b < kErbBandCount; ++b) by += shares_[j][b] * missing[b];
      levels[j] *= by;
    }
  }
  return levels;
}

double Hrtf::between(const DirectionMesh::Place& place,
                     float Direction::*frames) const noexcept REALTIME {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k)
    sum += static_cast<double>(place.share[k] * (directions_[place.corner[k]].*frames));
  return sum;
}

double Hrtf::delay_frames(const Vec3f& from, int ear) const noexcept REALTIME {
  return (ear == 0 ? -0.5 : 0.5) * between(place(from), &Direction::itd_frames);
}

double Hrtf::low_itd_frames(const DirectionMesh::Place& place) const noexcept REALTIME {
  return between(place, &Direction::low_itd_frames);
}

}  // namespace clamor
