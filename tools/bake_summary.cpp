#include "tools/bake_summary.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/scene.h"
#include "runtime/energy_response.h"
#include "tools/progress.h"

namespace clamor {

namespace {

constexpr std::size_t kPlaces = 4;
constexpr std::size_t kEnoughSources = 1000;

// Off to the sides and a little up or down, no two alike, so that no place lies on an axis of a
// room.
constexpr std::array<Vec3, kPlaces> kDirections = {Vec3(0.80, 0.13, 0.58), Vec3(-0.55, 0.21, 0.81),
                                                   Vec3(-0.83, -0.11, -0.55),
                                                   Vec3(0.51, 0.17, -0.84)};

// The places, each with the emitter it belongs to.
struct Place {
  Vec3 listener_m;
  std::uint32_t emitter;
};
std::vector<Place> places_in(const Scene& scene, const std::vector<Emitter>& emitters) {
  std::vector<Place> places;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const auto emitter = static_cast<std::uint32_t>(i * emitters.size() / kPlaces);
    const Vec3 direction = normalize(kDirections[i]);
    const auto hit = scene.intersect(emitters[emitter].position_m, direction);
    if (hit && hit->distance_m > 0.2)
      places.push_back(
          {emitters[emitter].position_m + direction * (0.5 * hit->distance_m), emitter});
  }
  return places;
}

// The sources of an emitter, or of all, that are in sight of a place.
std::vector<Source> sources_in_sight(const Scene& scene, const BakeContents& contents,
                                     const Place& place, std::optional<std::uint32_t> emitter) {
  std::vector<Source> seen;
  for (const Source& source : contents.octree.sources) {
    if (source.is_emitter || (emitter && source.emitter != *emitter)) continue;
    const Vec3 from_m = scene.away_from_surface(Vec3(source.position_m), Vec3(source.normal));
    const Vec3 way = place.listener_m - from_m;
    if (!(dot(way, Vec3(source.normal)) > 0)) continue;
    const double distance_m = length(way);
    const auto hit = scene.intersect(from_m, way / distance_m);
    if (!hit || hit->distance_m >= distance_m) seen.push_back(source);
  }
  return seen;
}

void print_energy(const BakeContents& contents, std::ostream& err) {
  const BakeStatistics& statistics = contents.statistics;
  const double photons = static_cast<double>(std::max<std::uint64_t>(1, statistics.photons_traced));
  fmt::print(err,
             "  traced   {} photons, {:.1f} bounces each, mean free path {:.2f} m; {:.1f} % of the "
             "photons escaped\n",
             statistics.photons_traced, static_cast<double>(statistics.bounces) / photons,
             statistics.mean_free_path_m,
             100 * static_cast<double>(statistics.photons_escaped) / photons);
}

}  // namespace

BakeDecay decay_of(const BakeContents& contents) {
  BakeDecay decay;
  if (contents.mesh.triangles.empty()) return decay;
  const Scene scene(contents.mesh);
  std::array<std::vector<double>, kBandCount> found;
  // One emitter's decay where it has sources enough to show one; that of all together in a crowd.
  const bool crowd = contents.octree.sources.size() < kEnoughSources * contents.emitters.size();
  for (const Place& place : places_in(scene, contents.emitters)) {
    const auto emitter = crowd ? std::nullopt : std::optional(place.emitter);
    const auto arrivals =
        energy_response(sources_in_sight(scene, contents, place, emitter), contents.emitters,
                        contents.materials, contents.settings.air, place.listener_m, emitter);
    const RoomParameters parameters =
        room_parameters(arrivals, free_field_energy_at_10m(contents.emitters[place.emitter]));
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (parameters.t30_s[b]) found[b].push_back(*parameters.t30_s[b]);
    ++decay.places;
  }
  for (std::size_t b = 0; b < kBandCount; ++b) {
    if (2 * found[b].size() <= decay.places) continue;  // most places cannot tell
    std::sort(found[b].begin(), found[b].end());
    const std::size_t middle = found[b].size() / 2;
    decay.t30_s[b] = found[b].size() % 2 == 1 ? found[b][middle]
                                              : 0.5 * (found[b][middle - 1] + found[b][middle]);
  }
  return decay;
}

void print_bake_summary(const BakeContents& contents, const BakeReport& report,
                        const std::string& output, const std::string& journal, double seconds,
                        std::ostream& err) {
  const BakeStatistics& statistics = contents.statistics;
  double emitted = 0, unfinished = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    emitted += static_cast<double>(statistics.power_emitted[b]);
    unfinished += static_cast<double>(statistics.power_unfinished[b]);
  }
  if (emitted > 0 && unfinished > 0.001 * emitted)
    fmt::print(err, "  warning  {:.2f} % of the power was still under way at the longest path\n",
               100 * unfinished / emitted);
  for (const auto& warning : statistics.warnings) fmt::print(err, "  warning  {}\n", warning);
  if (!report.journal_warning.empty()) fmt::print(err, "  warning  {}\n", report.journal_warning);

  print_energy(contents, err);
  const BakeDecay decay = decay_of(contents);
  std::string times;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const std::string band = kBandCentres_hz[b] < 1000
                                 ? fmt::format("{:.0f}", kBandCentres_hz[b])
                                 : fmt::format("{:.0f}k", kBandCentres_hz[b] / 1000);
    times += fmt::format("{}{} {}", b > 0 ? ", " : "", band,
                         decay.t30_s[b] ? fmt::format("{:.2f}", *decay.t30_s[b]) : "-");
  }
  if (std::any_of(decay.t30_s.begin(), decay.t30_s.end(),
                  [](const auto& t) { return t.has_value(); }))
    fmt::print(err, "  decays   T30 in s at Hz: {}\n", times);
  else
    fmt::print(err, "  decays   too dry to tell a T30\n");

  if (report.photons_reused > 0)
    fmt::print(err, "  reused   {} of {} photons from {}\n", report.photons_reused,
               statistics.photons_traced, journal);
  std::error_code ignored;
  const auto bytes = std::filesystem::file_size(output, ignored);
  fmt::print(err, "  wrote    {}: {} sources in {:.1f} MB, {:.1f} s\n", output,
             contents.octree.sources.size(), static_cast<double>(bytes) / 1e6, seconds);
  if (!journal.empty())
    fmt::print(err, "  kept     {} ({:.1f} MB): baking again traces only what has changed\n",
               journal, static_cast<double>(report.journal_bytes) / 1e6);
  fmt::print(err, "  listen   clamor play {}\n", output);
}

}  // namespace clamor
