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
  room.surfaces = std::make_unique<OcclusionGeometry>(room.mesh, file.materials(), room.sources);
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
        room.missing_key > 0 ? std::max(1.0, room.missing_key / sum_of(source.power)) : 1;
    for (std::size_t b = 0; b < kBandCount; ++b)
      excitation.energy_at_10m[b] += static_cast<float>(
          scale * static_cast<double>(source.power[b]) / (4 * std::numbers::pi * 10 * 10));
  }
  excitation.words =
      "all " + grouped(std::max<std::uint64_t>(count, emitters.size())) + " emitters at once";
  return excitation;
}

double middle_t30_s(const Bands& t30_s) {
  static_assert(kBandCentres_hz[3] == 500 && kBandCentres_hz[4] == 1000);
  return t30_s[3] > 0 && t30_s[4] > 0 ? (t30_s[3] + t30_s[4]) / 2.0 : 0;
}

}  // namespace clamor
