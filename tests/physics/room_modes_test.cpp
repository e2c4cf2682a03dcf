// Strength and decay of a small room at low frequencies, against the exact sound field of its
// modes.
//
// Below the Schroeder frequency, 2000 sqrt(T / V), single modes can be told apart. Clamor's images
// of the first orders interfere as they do, its photons do not. bake/README.md states the figures
// that are printed here.
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/air.h"
#include "common/decay_curve.h"
#include "common/sample_rate.h"
#include "formats/bake_file/expanded_sources.h"
#include "runtime/response/impulse_response.h"
#include "runtime/response/octave_filter.h"
#include "tests/physics/modal_room.h"
#include "tests/rooms.h"
#include "tools/analysis/room_parameters.h"

namespace clamor {
namespace {

using testing::Complex;
using testing::FrequencyGrid;
using testing::modal_pressure;
using testing::ModalRoom;

constexpr std::size_t kModalBands = 5;  // 63 Hz to 1 kHz
constexpr Vec3 kModalSource_m(1.3, 0.9, 1.0);
constexpr double kModalEar_m = 1.7;
constexpr std::size_t kInside = 20;

// The Schroeder frequency of this room is 255 Hz.
ModalRoom modal_room() { return {{5, 4, 3}, 1.0 / 70, speed_of_sound_mps(Air{})}; }

// Places at least 0.7 m from the walls, then the four corners.
std::vector<Vec3> modal_places() {
  std::vector<Vec3> places_m;
  for (std::size_t i = 1; i <= kInside; ++i) {
    const auto n = static_cast<double>(i);  // the R2 sequence, M. Roberts 2018
    places_m.emplace_back(0.7 + 3.6 * std::fmod(n * 0.7548776662, 1),
                          0.7 + 2.6 * std::fmod(n * 0.5698402910, 1), kModalEar_m);
  }
  for (const double x : {0.05, 4.95})
    for (const double y : {0.05, 3.95}) places_m.emplace_back(x, y, kModalEar_m);
  return places_m;
}

// How much lower diffuse sound is inside a room than its energy over its volume, because it is
// stronger at the walls (R. V. Waterhouse. Interference patterns in reverberant sound fields. J.
// Acoust. Soc. Am. 27, 1955).
double waterhouse_db(const ModalRoom& room, double frequency_hz) {
  const Vec3& m = room.size_m;
  const double per_m = 2 * (1 / m.x + 1 / m.y + 1 / m.z);
  return 10 * std::log10(1 + per_m * room.speed_mps / frequency_hz / 8);
}

struct PlaceFigures {
  std::array<double, kModalBands> g_db{}, t30_s{};
};

PlaceFigures exact_figures(const std::vector<std::vector<Complex>>& pressure, std::size_t place,
                           double step_hz) {
  PlaceFigures figures;
  for (std::size_t b = 0; b < kModalBands; ++b) {
    const double step_s = 0.7 / octave_width_hz(b);
    std::vector<std::pair<Complex, Complex>> band;  // value, and its turn in a step of time
    double energy = 0, free_field = 0;
    for (std::size_t f = 0; f < pressure.size(); ++f) {
      const double hz = step_hz * static_cast<double>(f + 1), gain = octave_gain(b, hz);
      const Complex filtered = gain * pressure[f][place];
      energy += std::norm(filtered);
      free_field += gain * gain / 100;  // at 10 m
      if (gain > 1e-4)
        band.emplace_back(filtered, std::polar(1.0, 2 * std::numbers::pi * hz * step_s));
    }
    figures.g_db[b] = 10 * std::log10(energy / free_field);
    std::vector<EnergyStep> envelope;
    for (double t_s = 0; t_s < 0.8 / step_hz; t_s += step_s) {
      Complex sum = 0;
      for (auto& [value, turn] : band) {
        sum += value;
        value *= turn;
      }
      envelope.push_back({t_s, std::norm(sum)});
    }
    figures.t30_s[b] =
        DecayCurve(envelope, envelope.back().time_s).decay_time_s(-5, -35).value_or(0);
  }
  return figures;
}

// Level in dB at each frequency of an octave.
std::vector<double> levels_db(const std::vector<float>& waveform, std::size_t band,
                              double step_hz) {
  std::vector<double> levels;
  const double low_hz = kBandCentres_hz[band] / std::numbers::sqrt2;
  for (double n = std::ceil(low_hz / step_hz); n * step_hz < 2 * low_hz; ++n) {
    const Complex turn = std::polar(1.0, -2 * std::numbers::pi * n * step_hz / kSampleRate_hz);
    Complex sum = 0, phase = 1;
    for (const float sample : waveform) {
      sum += static_cast<double>(sample) * phase;
      phase *= turn;
    }
    levels.push_back(10 * std::log10(std::norm(sum)));
  }
  return levels;
}

std::vector<double> levels_db(const std::vector<std::vector<Complex>>& pressure, std::size_t place,
                              std::size_t band, double step_hz) {
  std::vector<double> levels;
  const double low_hz = kBandCentres_hz[band] / std::numbers::sqrt2;
  for (double n = std::ceil(low_hz / step_hz); n * step_hz < 2 * low_hz; ++n)
    levels.push_back(10 * std::log10(std::norm(pressure[static_cast<std::size_t>(n) - 1][place])));
  return levels;
}

struct MeanAndSpread {
  double mean = 0, spread = 0;
};

MeanAndSpread mean_and_spread(const std::vector<double>& values) {
  MeanAndSpread result;
  const auto n = static_cast<double>(values.size());
  for (const double value : values) result.mean += value / n;
  for (const double value : values)
    result.spread += (value - result.mean) * (value - result.mean) / (n - 1);
  result.spread = std::sqrt(result.spread);
  return result;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const MeanAndSpread of_a = mean_and_spread(a), of_b = mean_and_spread(b);
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - of_a.mean) * (b[i] - of_b.mean);
  return sum / (static_cast<double>(a.size() - 1) * of_a.spread * of_b.spread);
}

using ByBand = std::array<MeanAndSpread, kModalBands>;

ByBand by_band(const std::array<std::vector<double>, kModalBands>& values) {
  ByBand result;
  for (std::size_t b = 0; b < kModalBands; ++b)
    if (!values[b].empty()) result[b] = mean_and_spread(values[b]);
  return result;
}

void print_row(const std::string& title, const ByBand& values) {
  std::cout << std::left << std::setw(36) << title << std::right << std::fixed
            << std::setprecision(2);
  for (const MeanAndSpread& one : values)
    if (one.spread > 0)
      std::cout << std::setw(8) << one.mean << " +-" << std::setw(5) << one.spread;
  std::cout << '\n';
}

TEST(RoomModes, OfTheReferenceDoNotDependOnTheAxisThatIsNotSummed) {
  const ModalRoom room = modal_room();
  const FrequencyGrid grid{.step_hz = 1, .highest_hz = 300};
  const Vec3 listener_m(4.1, 2.3, 1.9);
  const auto turned = [](const Vec3& v) { return Vec3(v.y, v.z, v.x); };
  const auto a = modal_pressure(room, grid, kModalSource_m, {listener_m});
  const auto b = modal_pressure({turned(room.size_m), room.admittance, room.speed_mps}, grid,
                                turned(kModalSource_m), {turned(listener_m)});
  for (std::size_t f = 40; f < a.size(); ++f)
    EXPECT_NEAR(std::abs(b[f][0] / a[f][0] - 1.0), 0, 2e-3) << f + 1 << " Hz";
}

TEST(RoomModes, HaveTheMeanEnergyOfPhotonsAboveTheSchroederFrequency) {
  const ModalRoom room = modal_room();
  const FrequencyGrid grid;
  const auto places_m = modal_places();
  const auto exact = modal_pressure(room, grid, kModalSource_m, places_m);

  const auto absorption = static_cast<float>(room.absorption());
  const Level level = testing::shoebox(
      room.size_m, testing::uniform_material(absorption, 0.1f, kMirrorExponent), kModalSource_m);
  const auto baked = bake(level, {.settings = {.sources = 10000}});
  ASSERT_TRUE(baked.ok());
  std::vector<Source> sources = baked->octree.sources;
  const auto images = image_sources(baked->images, baked->emitters);
  sources.insert(sources.end(), images.begin(), images.end());
  const OcclusionGeometry surfaces(baked->mesh, baked->materials, sources);
  const Bands at_10m = free_field_energy_at_10m(level.emitters[0]);

  std::array<std::vector<double>, kModalBands> g_db, corner_g_db, energy_g_db, t30_ratio, alike;
  for (std::size_t p = 0; p < places_m.size(); ++p) {
    const auto arrivals = energy_response(sources, baked->emitters, baked->materials, level.air,
                                          places_m[p], 0, &surfaces);
    const auto waveform = impulse_response(arrivals, whole_response_frames(arrivals));
    const RoomParameters of_energy = room_parameters(arrivals, at_10m),
                         heard = room_parameters(std::span<const float>(waveform), at_10m);
    const PlaceFigures truth = exact_figures(exact, p, grid.step_hz);
    for (std::size_t b = 0; b < kModalBands; ++b) {
      (p < kInside ? g_db : corner_g_db)[b].push_back(*heard.g_db[b] - truth.g_db[b]);
      if (p >= kInside) continue;
      energy_g_db[b].push_back(*of_energy.g_db[b] - truth.g_db[b]);
      t30_ratio[b].push_back(*of_energy.t30_s[b] / truth.t30_s[b]);
      if (b < 3 && p < 8)
        alike[b].push_back(correlation(levels_db(waveform, b, grid.step_hz),
                                       levels_db(exact, p, b, grid.step_hz)));
    }
  }
  const ByBand inside = by_band(energy_g_db), in_corners = by_band(corner_g_db),
               decay = by_band(t30_ratio);
  std::cout << "Clamor against the modes, octaves from 63 Hz to 1 kHz\n";
  print_row("G of energies inside, dB", inside);
  print_row("G of the waveform inside, dB", by_band(g_db));
  print_row("G of the waveform in corners, dB", in_corners);
  print_row("T30 of energies inside, ratio", decay);
  print_row("correlation of levels in the octave", by_band(alike));

  // Two seeds differ by 0.1 dB. In the lowest octave, only eight modes make the level.
  for (std::size_t b = 1; b < kModalBands; ++b)
    EXPECT_NEAR(inside[b].mean, waterhouse_db(room, kBandCentres_hz[b]), 0.6)
        << kBandCentres_hz[b] << " Hz";
  EXPECT_GT(inside[0].mean, 2);
  EXPECT_LT(inside[3].spread, 1.2);
  EXPECT_LT(inside[4].spread, 1);
  for (const MeanAndSpread& one : in_corners) EXPECT_LT(one.mean, -1.5);
  EXPECT_NEAR(decay[4].mean, 1, 0.05);
  EXPECT_LT(decay[0].mean, 0.9);
}

}  // namespace
}  // namespace clamor
