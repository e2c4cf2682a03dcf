// experiment_room.cpp: a room that was measured, baked and set beside its measurement.
//
// A description (formats/room.schema.json) names the geometry and says what the surfaces are, where
// sources and receivers were, and what was measured at pairs of them or in the mean of all. Values
// in third octaves become octaves by the mean of the thirds within each. The room is baked with
// several seeds, and the energies of all sources are measured at every pair.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "bake/report/level_report.h"
#include "common/text.h"
#include "common/utf8_path.h"
#include "formats/files/json.h"
#include "formats/gltf/level_import.h"
#include "formats/level/acoustic_values.h"
#include "formats/level/emitter_spec.h"
#include "formats/level/level_origin.h"
#include "formats/level/sidecar.h"
#include "tools/analysis/room_parameters.h"
#include "tools/experiments/baked_level.h"
#include "tools/experiments/experiments.h"
#include "tools/experiments/room_comparison.h"

namespace clamor {

namespace {

using Value = RoomParameters::Value;

constexpr std::uint64_t kQuickRoomSources = 20'000;
constexpr int kQuickBakes = 2;

struct MeasuredRoom {
  std::string name, source;
  Level level;  // emitters are the sources
  std::vector<ListenerSpec> receivers;
  std::vector<RoomFigures> figures;

  std::size_t pairs() const { return level.emitters.size() * receivers.size(); }
  std::string name_of(std::size_t pair) const {
    return level.emitters[pair / receivers.size()].name + " " +
           receivers[pair % receivers.size()].name;
  }
};

// A material whose lists at "bandsHz" are replaced by octaves. What is wrong with it is left to its
// reader.
Json in_octaves(const Json& material) {
  if (material.object() == nullptr || material.list("bandsHz").empty()) return material;
  std::vector<double> hz;
  for (const Json& one : material.list("bandsHz"))
    if (const double* value = one.number(); value != nullptr && (hz.empty() || *value > hz.back()))
      hz.push_back(*value);
  Json::Object members;
  for (const auto& [key, list] : *material.object()) {
    if (key == "bandsHz") continue;
    std::vector<double> values;
    for (const Json& one : material.list(key))
      if (const double* value = one.number()) values.push_back(*value);
    if (list.array() == nullptr) {
      members.emplace_back(key, list);
      continue;
    }
    if (values.size() != hz.size() || hz.size() != material.list("bandsHz").size()) return material;
    const Value octaves = octave_means(hz, values);
    const Bands between = bands_from_points(hz, values);
    Json::Array bands;
    for (std::size_t b = 0; b < kBandCount; ++b)
      bands.emplace_back(octaves[b].value_or(static_cast<double>(between[b])));
    members.emplace_back(key, Json(std::move(bands)));
  }
  return Json(std::move(members));
}

Result<void> read_materials(const Json* json, const std::string& path,
                            std::vector<Material>& materials) {
  if (json == nullptr) return {};
  if (json->object() == nullptr) return Error(path + ": 'materials' must be an object");
  for (const auto& [name, values] : *json->object()) {
    const auto of_level = std::ranges::find(materials, name, &Material::name);
    if (of_level == materials.end()) {
      std::vector<std::string> names;
      for (const Material& material : materials) names.push_back(material.name);
      return Error(path + ": the level has no material " + in_quotes(name) +
                   "; the nearest name is " + in_quotes(nearest_name(name, names)));
    }
    auto read = read_acoustic_material(in_octaves(values), name, MaterialPresets::built_in());
    if (!read.ok()) return read.error().in(path);
    *of_level = std::move(read->material);
  }
  return {};
}

Result<Emitter> read_source(const Json& json, const std::string& where, const MeasuredRoom& room) {
  JsonFields fields(json, where);
  Emitter emitter;
  emitter.name = fields.string("name").value_or("");
  const auto at_m = fields.vector("at", kMaxWorldCoordinate_m),
             facing = fields.vector("facing", kMaxWorldCoordinate_m);
  if (!at_m || emitter.name.empty()) fields.fail("needs 'name' and 'at'");
  if (facing && !(length(*facing) > 0)) fields.fail("'facing' must not be zero");
  emitter.position_m = at_m.value_or(Vec3()) - room.level.origin_m;
  if (facing) emitter.axis = normalize(*facing);
  emitter.directivity = bands_member(fields, "directivity", 0, kMaxDirectivity).value_or(Bands{});
  if (auto read = fields.result_without_unknown(); !read.ok()) return read.error();
  return emitter;
}

Result<ListenerSpec> read_receiver(const Json& json, const std::string& where,
                                   const MeasuredRoom& room) {
  JsonFields fields(json, where);
  const auto name = fields.string("name");
  const auto at_m = fields.vector("at", kMaxWorldCoordinate_m);
  if (!at_m || !name || name->empty()) fields.fail("needs 'name' and 'at'");
  if (auto read = fields.result_without_unknown(); !read.ok()) return read.error();
  return ListenerSpec{*name, *at_m - room.level.origin_m};
}

// Values beyond these are in another unit.
std::pair<double, double> range_of(const ParameterKind& kind) {
  if (kind.unit == std::string_view("s")) return {kShortestDecay_s, kLongestDecay_s};
  return kind.unit == std::string_view("dB") ? std::pair(-100.0, 100.0) : std::pair(0.0, 1.0);
}

Result<RoomFigures> read_figures(const Json& json, const std::string& where,
                                 const MeasuredRoom& room) {
  JsonFields fields(json, where);
  RoomFigures figures;
  figures.by = fields.string("by").value_or("");
  const auto source = fields.string("source"), receiver = fields.string("receiver");
  for (std::size_t pair = 0; pair < room.pairs(); ++pair)
    if ((!source || room.level.emitters[pair / room.receivers.size()].name == *source) &&
        (!receiver || room.receivers[pair % room.receivers.size()].name == *receiver))
      figures.pairs.push_back(pair);
  if (figures.pairs.empty()) fields.fail("names a source or a receiver that the room has not");
  for (const ParameterKind& kind : kParameterKinds) {
    const auto [low, high] = range_of(kind);
    if (const auto octaves = octaves_member(fields, kind.key, low, high))
      figures.values.*kind.value = *octaves;
  }
  if (auto read = fields.result_without_unknown(); !read.ok()) return read.error();
  return figures;
}

// Whether an element of a list has the name of one before it. Figures have none.
template <class T>
bool is_named_twice(std::span<const T> list) {
  if constexpr (requires { list[0].name; })
    for (const T& one : list.first(list.size() - 1))
      if (one.name == list.back().name) return true;
  return false;
}

// Appends what `read` makes of each element of a list.
template <class T, class Read>
Result<void> read_list(const Json& json, const std::string& path, const char* key,
                       std::vector<T>& list, const Read& read) {
  if (json.list(key).empty())
    return Error(fmt::format("{}: needs '{}', a list of at least one", path, key));
  for (const Json& item : json.list(key)) {
    auto one = read(item, fmt::format("{}: {} {}", path, key, list.size() + 1));
    if (!one.ok()) return one.error();
    list.push_back(std::move(*one));
    if (is_named_twice<T>(list))
      return Error(fmt::format("{}: {} {} has the name of another; give each its own", path, key,
                               list.size()));
  }
  return {};
}

Result<MeasuredRoom> read_room(const std::string& path) {
  const auto json = read_json(path);
  if (!json.ok()) return json.error();
  JsonFields fields(*json, path);
  MeasuredRoom room;
  const auto file = fields.string("level");
  if (!file) fields.fail("needs 'level', the glTF file of the room");
  room.name = fields.string("name").value_or(path);
  room.source = fields.string("source").value_or("");
  for (const char* key : {"sources", "receivers", "measured"}) fields.any(key);
  const Json *materials = fields.any("materials"), *air = fields.any("air");
  if (auto read = fields.result_without_unknown(); !read.ok()) return read.error();
  auto imported =
      import_level((path_of(path).parent_path() / path_of(*file)).string(), ImportOptions());
  if (!imported.ok()) return imported.error();
  room.level = std::move(imported->level);
  prepare_level(room.level, {.rounding_m = imported->rounding_m});
  room.level.signals = {{"impulse", {1}, false}};
  room.level.emitters.clear();
  if (auto read = read_materials(materials, path, room.level.materials); !read.ok())
    return read.error();
  if (air != nullptr) {
    const auto read = read_air(*air, path + ": air", room.level.air);
    if (!read.ok()) return read.error();
    room.level.air = *read;
  }
  const auto of_level = [&](const auto& read) {
    return [&room, read](const Json& item, const std::string& where) {
      return read(item, where, room);
    };
  };
  Result<void> lists =
      read_list(*json, path, "sources", room.level.emitters, of_level(read_source));
  if (lists.ok())
    lists = read_list(*json, path, "receivers", room.receivers, of_level(read_receiver));
  if (lists.ok()) lists = read_list(*json, path, "measured", room.figures, of_level(read_figures));
  if (!lists.ok()) return lists.error();
  return room;
}

Result<AtPairs> baked_and_measured(const MeasuredRoom& room, const BakeSettings& settings) {
  const auto baked = BakedEnergies::bake_level(room.level, settings);
  if (!baked.ok()) return baked.error();
  AtPairs measured;
  for (std::uint32_t s = 0; s < room.level.emitters.size(); ++s)
    for (const ListenerSpec& receiver : room.receivers)
      measured.push_back(room_parameters(baked->at(receiver.at_m, s),
                                         free_field_energy_at_10m(room.level.emitters[s])));
  return measured;
}

}  // namespace

Result<ReportPage> room_experiment(const ExperimentOptions& options, std::ostream& err) {
  const auto room = read_room(options.level);
  if (!room.ok()) return room.error();
  BakeSettings settings;
  settings.longest_path_s = 0;
  settings.air = room->level.air;
  if (options.quick) settings.sources = kQuickRoomSources;
  const int bakes = options.quick ? kQuickBakes : options.bakes;
  std::vector<AtPairs> by_seed;
  for (int seed = 1; seed <= bakes; ++seed) {
    settings.seed = static_cast<std::uint64_t>(seed);
    auto measured = baked_and_measured(*room, settings);
    if (!measured.ok()) return measured.error();
    by_seed.push_back(std::move(*measured));
    err << fmt::format("  seed {} of {}\n", seed, bakes);
  }

  ReportTable means{
      "means", "In the mean of what was measured", octave_columns({"parameter", "figure"}), {}},
      pairs{"pairs", "At every pair", octave_columns({"pair", "parameter", "figure"}), {}, true};
  std::vector<std::string> names;
  for (std::size_t pair = 0; pair < room->pairs(); ++pair) names.push_back(room->name_of(pair));
  const RoomComparison comparison(room->figures, names, by_seed);
  std::vector<Chart> charts;
  std::string summary;
  for (const ParameterKind& kind : kParameterKinds) {
    comparison.add(kind, means, charts, summary);
    for (std::size_t pair = 0; pair < room->pairs(); ++pair) comparison.add_pair(pair, kind, pairs);
  }
  if (charts.empty())
    return Error(options.level + ": 'measured' has no value at the centre of an octave");
  ReportPage page("room", room->name + ", beside its measurement",
                  fmt::format("{}: {} sources, {} receivers, {} seeds", options.level,
                              room->level.emitters.size(), room->receivers.size(), bakes));
  summary =
      "Mean size of the differences from 250 Hz to 4 kHz, in just-noticeable differences "
      "(JND; ISO 3382-1: 5 % of EDT, T20 and T30, 1 dB of C80 and G, 0.05 of D50, 10 ms of "
      "Ts): " +
      summary + ".";
  err << "  " << summary << '\n';
  page.paragraph(summary);
  if (!room->source.empty()) page.paragraph("The measurement: " + room->source);
  page.charts(charts, 2, "In octaves: of third octaves the mean.");
  page.table(std::move(means));
  page.table(std::move(pairs));
  return page;
}

}  // namespace clamor
