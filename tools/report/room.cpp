#include "tools/report/room.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/text.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/bake_file/mesh_at_rest.h"
#include "tools/analysis/room_parameters.h"
#include "tools/program/text_format.h"

namespace clamor {

namespace {

// An emitter with fewer reflections than this has no response of its own.
constexpr std::uint64_t kEnoughSources = 2000;
constexpr double kLatest_nepers = 4.5 * 2.302585;  // 45 dB: T30 ends at 35

double total_power(const Source& source) { return sum_of(source.power); }

// How many times as likely a source is chosen for its delay.
double lateness(const Source& source, double t60_s) {
  if (!(t60_s > 0)) return 1;
  const double nepers =
      std::min(6 * std::numbers::ln10 * static_cast<double>(source.delay_s) / t60_s, kLatest_nepers);
  return 1 + std::expm1(nepers) / kLatest_nepers;
}

bool is_always_taken(const Source& source, bool all_emitters) {
  return source.is_image || (all_emitters && source.is_emitter);
}

}  // namespace

Result<Room> Room::read(const BakeFile& file, std::size_t max_sources) {
  Room room;
  room.file = &file;
  auto strongest = read_strongest_sources(file, max_sources);
  if (!strongest.ok()) return strongest.error();
  room.sources = std::move(strongest->sources);
  room.missing_key = strongest->missing_key;
  room.playing = std::move(strongest->emitters);
  room.playing_of.reserve(room.sources.size());
  for (Source& source : room.sources) {
    room.playing_of.push_back(source.emitter);
    source.emitter = strongest->stored_as[source.emitter];
  }
  auto mesh = read_mesh_at_rest(file);
  if (!mesh.ok()) return mesh.error();
  room.mesh = std::move(*mesh);
  room.surfaces = std::make_unique<OcclusionGeometry>(room.mesh, file.materials());
  return room;
}

Result<std::uint32_t> find_emitter(const std::vector<Emitter>& emitters, const std::string& name) {
  std::vector<std::string> names;
  for (const Emitter& emitter : emitters) names.push_back(emitter.name);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<std::uint32_t>(found - names.begin());
  return Error("there is no emitter " + in_quotes(name) + "; the nearest of " +
               std::to_string(names.size()) + " names is " + in_quotes(nearest_name(name, names)));
}

Result<Excitation> excitation_of(const Room& room, const std::string& emitter_name) {
  const std::vector<Emitter>& emitters = room.emitters();
  const std::string& path = room.file->path();
  if (emitters.empty())
    return Error("the file has no emitters, so nothing can be heard. Bake it with one.").in(path);
  Excitation excitation;
  if (!emitter_name.empty()) {
    const auto found = find_emitter(emitters, emitter_name);
    if (!found.ok()) return found.error().in(path);
    excitation.emitter = *found;
  } else if (room.file->source_count() / emitters.size() >= kEnoughSources) {
    excitation.emitter = 0;
  }
  if (excitation.emitter) {
    const Emitter& emitter = emitters[*excitation.emitter];
    excitation.words = in_quotes(emitter.name);
    excitation.energy_at_10m = free_field_energy_at_10m(emitter);
    return excitation;
  }
  std::uint64_t count = 0;
  for (const Source& source : room.sources) {
    if (!source.is_emitter) continue;
    ++count;
    const double scale =
        room.missing_key > 0 ? std::max(1.0, room.missing_key / total_power(source)) : 1;
    for (std::size_t b = 0; b < kBandCount; ++b)
      excitation.energy_at_10m[b] += static_cast<float>(
          scale * static_cast<double>(source.power[b]) / (4 * std::numbers::pi * 10 * 10));
  }
  excitation.words = "all " + grouped(std::max<std::uint64_t>(count, emitters.size())) +
                     " emitters at once";
  return excitation;
}

std::vector<Source> fair_sample(const Room& room, const Excitation& excitation, std::size_t count,
                                double t60_s) {
  const auto sounds = [&](const Source& source) {
    return !excitation.emitter || source.emitter == *excitation.emitter;
  };
  const bool all_emitters =
      excitation.emitter.has_value() || room.emitters().size() <= kMaxExactEmitters;
  std::vector<Source> sample;
  struct Candidate {
    double priority, weight;
    std::size_t index;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < room.sources.size(); ++i) {
    const Source& source = room.sources[i];
    if (!sounds(source)) continue;
    if (is_always_taken(source, all_emitters)) {
      sample.push_back(source);
      continue;
    }
    const double weight = total_power(source) * lateness(source, t60_s);
    if (weight > 0)
      candidates.push_back({weight / static_cast<double>(source.u), weight, i});
  }
  double threshold = 0;
  if (candidates.size() > count) {
    const auto last = candidates.begin() + static_cast<std::ptrdiff_t>(count);
    std::nth_element(candidates.begin(), last, candidates.end(),
                     [](const Candidate& a, const Candidate& b) {
                       return a.priority != b.priority ? a.priority > b.priority
                                                       : a.index < b.index;
                     });
    threshold = last->priority;
    candidates.resize(count);
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return a.index < b.index; });
  }
  for (const Candidate& candidate : candidates) {
    Source source = room.sources[candidate.index];
    const double scale = std::max(
        {1.0, threshold / candidate.weight, room.missing_key / total_power(source)});
    for (float& band : source.power) band = static_cast<float>(scale * static_cast<double>(band));
    sample.push_back(source);
  }
  return sample;
}

double middle_t30_s(const Bands& t30_s) {
  static_assert(kBandCentres_hz[3] == 500 && kBandCentres_hz[4] == 1000);
  return t30_s[3] > 0 && t30_s[4] > 0 ? (t30_s[3] + t30_s[4]) / 2.0 : 0;
}

}  // namespace clamor
