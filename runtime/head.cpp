#include "runtime/head.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "common/fourier.h"
#include "formats/level.h"
#include "runtime/erb_bands.h"
#include "runtime/head_fit.h"

namespace clamor {

namespace {

constexpr std::size_t kLeastSpectrum = 8192;
constexpr double kLongestLag_s = 1e-3, kLagStep_s = 5e-6;
constexpr double kFollowed_hz = 1500;  // ears hear the wave itself below
constexpr int kTurns = 6;
constexpr double kQuietest = 1e-6;  // 60 dB below the loudest band: silence has no colour

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
  const double least = kQuietest * *std::ranges::max_element(energy);
  for (double& band : energy) band = std::max(band, std::max(least, 1e-30));
  return energy;
}

// How much later the right ear hears it: the lag of the greatest cross-correlation of what both
// hear below kFollowed_hz.
double lag_s(const Spectrum& left, const Spectrum& right, double bin_hz) {
  constexpr int kLags = static_cast<int>(kLongestLag_s / kLagStep_s);
  std::array<double, 2 * kLags + 1> alike{};
  for (std::size_t k = 1; static_cast<double>(k) * bin_hz < kFollowed_hz; ++k) {
    const std::complex<double> cross = left[k] * std::conj(right[k]);
    const double angle = 2 * std::numbers::pi * static_cast<double>(k) * bin_hz * kLagStep_s;
    // Its real part, turned by one step at a time: cos x = 2 cos(step) cos(x - step) - ...
    const double twice_cosine = 2 * std::cos(angle);
    double at = (cross * std::polar(1.0, kLags * angle)).real();
    double before = (cross * std::polar(1.0, (kLags + 1) * angle)).real();
    for (double& sum : alike) {
      sum += at;
      before = std::exchange(at, twice_cosine * at - before);
    }
  }
  const auto best = std::max_element(alike.begin() + 1, alike.end() - 1);
  const double bend = 2 * best[0] - best[-1] - best[1];
  const double between = bend > 0 ? std::clamp((best[1] - best[-1]) / (2 * bend), -0.5, 0.5) : 0;
  return (static_cast<double>(best - alike.begin()) - kLags + between) * kLagStep_s;
}

bool all_round(std::span<const Vec3f> directions) {
  // Some on each side of every plane through the head, or the nearest thing to it.
  Vec3f low(1), high(-1);
  for (const Vec3f& d : directions)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], d[axis]);
      high[axis] = std::max(high[axis], d[axis]);
    }
  for (int axis = 0; axis < 3; ++axis)
    if (low[axis] > -0.2f || high[axis] < 0.2f) return false;
  return true;
}

}  // namespace

Result<std::shared_ptr<const Head>> Head::read(const std::string& path) {
  auto responses = read_sofa(path);
  if (!responses.ok()) return responses.error();
  if (!all_round(responses->directions))
    return Error(path + ": was not measured from all sides; give a head that was.");
  return std::make_shared<const Head>(*responses);
}

Head::Head(const HeadResponses& responses) {
  // A pole may have been measured many times.
  std::vector<std::size_t> kept;
  std::vector<Vec3f> places;
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

  const Fourier fourier(std::max(kLeastSpectrum, std::bit_ceil(responses.frames)));
  const double bin_hz = responses.rate_hz / static_cast<double>(fourier.size());
  std::vector<std::array<ErbBands, kEars>> energies;
  ErbBands diffuse{};  // mean of all directions and both ears
  for (const std::size_t d : kept) {
    std::array<Spectrum, kEars> ears;
    auto& energy = energies.emplace_back();
    for (std::size_t e = 0; e < kEars; ++e) {
      ears[e] = spectrum_of(fourier, responses.response(d, e), responses.frames);
      energy[e] = energy_of(ears[e], bin_hz);
      for (std::size_t b = 0; b < kErbBandCount; ++b)
        diffuse[b] += energy[e][b] / static_cast<double>(kEars * kept.size());
    }
    directions_.push_back(
        {{}, {}, static_cast<float>(lag_s(ears[0], ears[1], bin_hz) * kSampleRate_hz), {}});
  }
  const HeadFit fit;
  for (std::size_t d = 0; d < kept.size(); ++d)
    for (std::size_t e = 0; e < kEars; ++e) {
      for (std::size_t b = 0; b < kErbBandCount; ++b) energies[d][e][b] /= diffuse[b];
      directions_[d].level[e] = fit.levels_for(energies[d][e]);
      directions_[d].octave[e] = fit.octaves_for(energies[d][e]);
      const ErbBands octaves = fit.octave_energy_of(directions_[d].octave[e]);
      const auto narrow = [](double x) { return static_cast<float>(x); };
      Energies& kept_energies = directions_[d].energies;
      std::ranges::transform(energies[d][e], kept_energies.measured[e].begin(), narrow);
      std::ranges::transform(octaves, kept_energies.octaves[e].begin(), narrow);
    }
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    double sum = 0;
    for (std::size_t j = 0; j < kHeadBands; ++j) sum += fit.shares()[j][b];
    for (std::size_t j = 0; j < kHeadBands; ++j) {
      shares_[j][b] = static_cast<float>(fit.shares()[j][b]);
      parts_[b][j] = static_cast<float>(fit.shares()[j][b] / sum);
    }
  }
}

template <class Levels>
std::array<Levels, kEars> Head::between(
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

std::array<HeadLevels, kEars> Head::hear(const Vec3f& from) const noexcept REALTIME {
  return between(place(from), &Direction::level);
}

std::array<Bands, kEars> Head::hear_octaves(
    const DirectionMesh::Place& place) const noexcept REALTIME {
  return between(place, &Direction::octave);
}

HeadLevels Head::changed_by(const ErbBands& change) const noexcept REALTIME {
  HeadLevels levels;
  levels.fill(1);
  for (int turn = 0; turn < kTurns; ++turn) {
    std::array<float, kErbBandCount> missing;
    for (std::size_t b = 0; b < kErbBandCount; ++b) {
      float now = 0;
      for (std::size_t j = 0; j < kHeadBands; ++j) now += parts_[b][j] * levels[j];
      missing[b] = static_cast<float>(change[b]) / now;
    }
    for (std::size_t j = 0; j < kHeadBands; ++j) {
      float by = 0;
      for (std::size_t b = 0; b < kErbBandCount; ++b) by += shares_[j][b] * missing[b];
      levels[j] *= by;
    }
  }
  return levels;
}

double Head::delay_frames(const Vec3f& from, int ear) const noexcept REALTIME {
  const DirectionMesh::Place place = mesh_->find(from);
  double lag_frames = 0;
  for (std::size_t k = 0; k < 3; ++k)
    lag_frames += static_cast<double>(place.share[k] * directions_[place.corner[k]].lag_frames);
  return (ear == 0 ? -0.5 : 0.5) * lag_frames;
}

}  // namespace clamor
