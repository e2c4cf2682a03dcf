// experiment_seeds.cpp: how much the room parameters of one bake depend on its seed.
//
// The level in the file is baked with several seeds, with the photons of the file and with four
// times as many; sources stay as many as the file has. Places are those of a measurement after ISO
// 3382-1: at the height of ears, a metre from all surfaces, in sight of the emitter.
//
// What the decay times of one waveform may be expected to vary by, Gaussian noise tells that decays
// as the energies do: late sound is such noise wherever many reflections overlap (M. R. Schroeder.
// Frequency-correlation functions of frequency responses in rooms. J. Acoust. Soc. Am. 34, 1962).
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/bounds.h"
#include "common/random.h"
#include "formats/level/level.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/response/impulse_response.h"
#include "tools/analysis/room_parameters.h"
#include "tools/experiments/baked_level.h"
#include "tools/experiments/experiments.h"

namespace clamor {

namespace {

constexpr std::size_t kLowestJudged = 1, kHighestJudged = 6;  // 125 Hz to 4 kHz
constexpr std::size_t kSeedPlaces = 6;
constexpr std::uint64_t kManyTimes = 4;  // the photons of the file
constexpr double kPulsesOfNoise_hz = 20'000;

struct SeedResult {
  RoomParameters of_energy, of_waveform, of_noise;
};

// Places by seed.
using SeedResults = std::vector<std::vector<SeedResult>>;

// Places that are drawn in the bounds of the level.
std::vector<Vec3> listening_places(const OcclusionGeometry& surfaces, const Mesh& mesh,
                                   const Vec3& emitter_m, std::size_t count) {
  const auto [low_m, high_m] =
      bounds_of(mesh.vertices_m, [](const Vec3f& vertex_m) { return Vec3(vertex_m); });
  std::vector<Vec3> places_m;
  for (std::uint32_t draw = 0; places_m.size() < count && draw < 1'000'000; ++draw) {
    const RandomBits bits = philox(0x73656564, {draw, 0, 0, 0});
    const Vec3 place_m =
        low_m + (high_m - low_m) * Vec3(unit(bits[0]), unit(bits[1]), unit(bits[2]));
    if (length(place_m - emitter_m) < 2 || !surfaces.is_free(Vec3f(emitter_m), Vec3f(place_m)) ||
        surfaces.is_free(Vec3f(place_m), Vec3f(place_m - Vec3(0, 1.5, 0))) ||
        !is_clear(surfaces, place_m, 1))
      continue;
    places_m.push_back(place_m);
  }
  return places_m;
}

// Pulses of random signs and times that decay with T30 in each octave, where that is known. There
// are so many that an octave of them is Gaussian noise.
std::vector<Arrival> decaying_noise(const RoomParameters& room, std::uint64_t seed,
                                    std::size_t place) {
  double longest_s = 0;
  for (const auto& t30_s : room.t30_s) longest_s = std::max(longest_s, t30_s.value_or(0));
  std::vector<Arrival> noise;
  for (std::uint32_t i = 0; i < longest_s * kPulsesOfNoise_hz; ++i) {
    const RandomBits bits = philox(seed, {0x6e6f6973, static_cast<std::uint32_t>(place), i, 0});
    Arrival& pulse = noise.emplace_back();
    pulse.time_s = (i + unit(bits[0])) / kPulsesOfNoise_hz;
    pulse.polarity = (bits[1] & 1) != 0 ? 1 : -1;
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (room.t30_s[b])
        pulse.energy[b] =
            static_cast<float>(std::exp(-std::log(1e6) * pulse.time_s / *room.t30_s[b]));
  }
  return noise;
}

Result<std::vector<SeedResult>> baked_with(const Level& level, const BakeSettings& settings,
                                           std::span<const Vec3> places_m) {
  const auto baked = BakedEnergies::bake_level(level, settings);
  if (!baked.ok()) return baked.error();
  const Bands at_10m = free_field_energy_at_10m(level.emitters[0]);
  std::vector<SeedResult> results(places_m.size());
  for (std::size_t p = 0; p < places_m.size(); ++p) {
    const auto arrivals = baked->at(places_m[p], 0);
    const auto waveform = impulse_response(arrivals, whole_response_frames(arrivals));
    const RoomParameters room = room_parameters(arrivals, at_10m);
    const auto noise = decaying_noise(room, settings.seed, p);
    const auto decay = impulse_response(noise, whole_response_frames(noise));
    results[p] = {room, room_parameters(std::span<const float>(waveform), at_10m),
                  room_parameters(std::span<const float>(decay), at_10m)};
  }
  return results;
}

// Over the seeds; nothing if one of them has no value.
std::optional<Spread> over_seeds(const SeedResults& results, std::size_t place,
                                 RoomParameters SeedResult::*kind, const ParameterKind& judged,
                                 std::size_t band) {
  std::vector<double> values;
  for (const auto& places : results) {
    const auto& value = (places[place].*kind.*judged.value)[band];
    if (!value) return std::nullopt;
    values.push_back(*value);
  }
  return spread_of(values);
}

using Row = std::vector<ReportTable::Cell>;

// Adds the means of a number over the places to a row, octave by octave: empty cells where no place
// has one.
template <class Function>
Row with_octaves(Row row, std::size_t places, bool of_squares, const Function& number) {
  for (std::size_t b = kLowestJudged; b <= kHighestJudged; ++b) {
    double sum = 0;
    int count = 0;
    for (std::size_t p = 0; p < places; ++p)
      if (const std::optional<double> one = number(p, b)) {
        sum += of_squares ? *one * *one : *one;
        ++count;
      }
    if (count == 0)
      row.emplace_back(std::string());
    else
      row.emplace_back(of_squares ? std::sqrt(sum / count) : sum / count);
  }
  return row;
}

// Deviation over the seeds in just-noticeable differences, root mean square over the places.
Row with_deviations(Row row, const SeedResults& results, RoomParameters SeedResult::*kind,
                    const ParameterKind& judged) {
  return with_octaves(std::move(row), results[0].size(), true,
                      [&](std::size_t p, std::size_t b) -> std::optional<double> {
                        const auto over = over_seeds(results, p, kind, judged, b);
                        if (!over) return std::nullopt;
                        return over->deviation / judged.noticeable_at(over->mean);
                      });
}

// Difference that more photons make to the mean over seeds and places, in just-noticeable
// differences.
Row with_shifts(Row row, const SeedResults& from, const SeedResults& to,
                RoomParameters SeedResult::*kind, const ParameterKind& judged) {
  return with_octaves(std::move(row), from[0].size(), false,
                      [&](std::size_t p, std::size_t b) -> std::optional<double> {
                        const auto a = over_seeds(from, p, kind, judged, b),
                                   c = over_seeds(to, p, kind, judged, b);
                        if (!a || !c) return std::nullopt;
                        return (c->mean - a->mean) / judged.noticeable_at(a->mean);
                      });
}

}  // namespace

Result<ReportPage> seeds_experiment(const ExperimentOptions& options, std::ostream& err) {
  auto read = BakedLevel::open(options.level);
  if (!read.ok()) return read.error();
  const Level& level = read->level;
  const OcclusionGeometry surfaces(level.mesh, level.materials);
  const std::vector<Vec3> places_m =
      options.listener_m ? std::vector<Vec3>{*options.listener_m}
                         : listening_places(surfaces, level.mesh, level.emitters[0].position_m,
                                            options.quick ? 1 : kSeedPlaces);
  if (places_m.empty())
    return Error(options.level +
                 ": no place at the height of ears is a metre from all surfaces and sees the "
                 "first emitter; name one with --listener");
  const int bakes = options.quick ? 2 : options.bakes;
  BakeSettings settings = read->settings;
  if (options.quick) settings.photons = 1000, settings.sources = kQuickSources;
  const std::array<std::uint64_t, 2> photons = {settings.photons, kManyTimes * settings.photons};
  std::array<SeedResults, 2> by_photons;
  for (std::size_t n = 0; n < photons.size(); ++n) {
    settings.photons = photons[n];
    for (int seed = 1; seed <= bakes; ++seed) {
      settings.seed = static_cast<std::uint64_t>(seed);
      auto result = baked_with(level, settings, places_m);
      if (!result.ok()) return result.error();
      by_photons[n].push_back(std::move(*result));
      err << fmt::format("  {} photons, seed {} of {}\n", photons[n], seed, bakes);
    }
  }
  ReportTable spread{"spread",
                     "Standard deviation over the seeds, in just-noticeable differences",
                     octave_columns({"parameter", "of", "photons"}, kLowestJudged, kHighestJudged),
                     {}};
  ReportTable shift{
      "shift",
      "What four times the photons change in the mean, in just-noticeable differences",
      octave_columns({"parameter", "of"}, kLowestJudged, kHighestJudged),
      {}};
  for (const auto& [of, kind] : {std::pair("energies", &SeedResult::of_energy),
                                 std::pair("one waveform", &SeedResult::of_waveform)})
    for (const ParameterKind& judged : kParameterKinds) {
      if (judged.key == std::string("t20_s")) continue;  // T30 tells the same
      for (std::size_t n = 0; n < photons.size(); ++n)
        spread.rows.push_back(
            with_deviations({judged.name, of, photons[n]}, by_photons[n], kind, judged));
      shift.rows.push_back(
          with_shifts({judged.name, of}, by_photons[0], by_photons[1], kind, judged));
    }
  for (const ParameterKind& judged : kParameterKinds)
    if (judged.key == std::string("t30_s") || judged.key == std::string("edt_s"))
      spread.rows.push_back(with_deviations({judged.name, "decaying noise", photons[0]},
                                            by_photons[0], &SeedResult::of_noise, judged));
  ReportPage page("seeds", "Room parameters of one bake",
                  fmt::format("{}: {} seeds, {} places", options.level, bakes, places_m.size()));
  page.table(spread);
  page.table(shift);
  return page;
}

}  // namespace clamor
