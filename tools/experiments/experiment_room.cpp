// experiment_room.cpp: a room that was measured, baked and set beside its measurement.
//
// A description (formats/room.schema.json) names the geometry and says what the surfaces are, where
// sources and receivers were, and what was measured at pairs of them or in the mean of all. Values
// in third octaves become octaves by the mean of the thirds within each. The room is baked with
// several seeds, and the energies of all sources are measured at every pair.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "bake/bake.h"
#include "bake/report/level_report.h"
#include "common/text.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/files/json.h"
#include "formats/gltf/level_import.h"
#include "formats/level/acoustic_values.h"
#include "formats/level/emitter_spec.h"
#include "formats/level/level_origin.h"
#include "formats/level/sidecar.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "tools/analysis/room_parameters.h"
#include "tools/experiments/experiments.h"

namespace clamor {

namespace {

using Value = RoomParameters::Value;

constexpr std::uint64_t kQuickRoomSources = 20'000;
constexpr int kQuickBakes = 2;
constexpr std::size_t kFirstJudged = 2, kLastJudged = 6;  // 250 Hz to 4 kHz

// What was measured, or what another program found, in the mean of these pairs.
struct Figures {
  std::string by;                  // the program, or empty
  std::vector<std::size_t> pairs;  // source x number of receivers + receiver
  RoomParameters values;
};

struct MeasuredRoom {
  std::string name, source;
  Level level;
  std::vector<ListenerSpec> receivers;
  std::vector<Figures> figures;

  std::size_t pairs() const { return level.emitters.size() * receivers.size(); }
  std::string name_of(std::size_t pair) const {
    return level.emitters[pair / receivers.size()].name + " " +
           receivers[pair % receivers.size()].name;
  }
};

// Missing where an octave's centre is.
Value octaves_of(std::span<const double> hz, std::span<const double> values) {
  Value octaves;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double sum = 0;
    int count = 0;
    bool has_centre = false;
    for (std::size_t i = 0; i < hz.size(); ++i) {
      const double ratio = hz[i] / kBandCentres_hz[b];
      if (ratio < 1 / std::numbers::sqrt2 || ratio >= std::numbers::sqrt2) continue;
      sum += values[i];
      ++count;
      has_centre = has_centre || std::abs(ratio - 1) < 0.05;
    }
    if (has_centre) octaves[b] = sum / count;
  }
  return octaves;
}

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
    const Value octaves = octaves_of(hz, values);
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
  if (!at_m || !name) fields.fail("needs 'name' and 'at'");
  if (auto read = fields.result_without_unknown(); !read.ok()) return read.error();
  return ListenerSpec{*name, *at_m - room.level.origin_m};
}

Result<Figures> read_figures(const Json& json, const std::string& where, const MeasuredRoom& room) {
  JsonFields fields(json, where);
  Figures figures;
  figures.by = fields.string("by").value_or("");
  const auto source = fields.string("source"), receiver = fields.string("receiver");
  for (std::size_t pair = 0; pair < room.pairs(); ++pair)
    if ((!source || room.level.emitters[pair / room.receivers.size()].name == *source) &&
        (!receiver || room.receivers[pair % room.receivers.size()].name == *receiver))
      figures.pairs.push_back(pair);
  if (figures.pairs.empty()) fields.fail("names a source or a receiver that the room has not");
  const auto hz = fields.numbers("bandsHz").value_or(
      std::vector(kBandCentres_hz.begin(), kBandCentres_hz.end()));
  for (const ParameterKind& kind : kParameterKinds) {
    const auto values = fields.numbers(kind.key);
    if (values && values->size() != hz.size())
      fields.fail(fmt::format("'{}' must have a value for each of 'bandsHz'", kind.key));
    else if (values)
      figures.values.*kind.value = octaves_of(hz, *values);
  }
  if (auto read = fields.result_without_unknown(); !read.ok()) return read.error();
  return figures;
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
  }
  return {};
}

Result<void> read_air(const Json* json, const std::string& path, Air& air) {
  if (json == nullptr) return {};
  JsonFields fields(*json, path + ": air");
  air.temperature_c = fields.number("temperature_c", -60, 80).value_or(air.temperature_c);
  air.humidity_percent = fields.number("humidity_percent", 0, 100).value_or(air.humidity_percent);
  air.pressure_kpa = fields.number("pressure_kpa", 10, 200).value_or(air.pressure_kpa);
  return fields.result_without_unknown();
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
      import_level((std::filesystem::path(path).parent_path() / *file).string(), ImportOptions());
  if (!imported.ok()) return imported.error();
  room.level = std::move(imported->level);
  prepare_level(room.level, {.rounding_m = imported->rounding_m});
  room.level.signals = {{"impulse", {1}, false}};
  room.level.emitters.clear();
  if (auto read = read_materials(materials, path, room.level.materials); !read.ok())
    return read.error();
  if (auto read = read_air(air, path, room.level.air); !read.ok()) return read.error();
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

// The parameters at each pair.
using AtPairs = std::vector<RoomParameters>;

Result<AtPairs> baked_and_measured(const MeasuredRoom& room, const OcclusionGeometry& surfaces,
                                   const BakeSettings& settings) {
  BakeOptions options;
  options.settings = settings;
  const auto contents = bake(room.level, options);
  if (!contents.ok()) return contents.error();
  std::vector<Source> sources = contents->octree.sources;
  const auto images = image_sources(contents->images, contents->emitters);
  sources.insert(sources.end(), images.begin(), images.end());
  AtPairs measured;
  for (std::uint32_t s = 0; s < room.level.emitters.size(); ++s)
    for (const ListenerSpec& receiver : room.receivers)
      measured.push_back(
          room_parameters(energy_response(sources, contents->emitters, contents->materials,
                                          room.level.air, receiver.at_m, s, &surfaces),
                          free_field_energy_at_10m(room.level.emitters[s])));
  return measured;
}

bool is_empty(const Value& values) {
  return std::ranges::none_of(values, [](const auto& value) { return value.has_value(); });
}

std::string unit_of(const ParameterKind& kind) {
  return *kind.unit != '\0' ? fmt::format(" ({})", kind.unit) : "";
}

// Adds a row with a cell for each octave, empty where there is no value.
void add_row(ReportTable& table, std::vector<ReportTable::Cell> row, const Value& values) {
  for (const auto& value : values)
    row.push_back(value ? ReportTable::Cell(*value) : ReportTable::Cell(std::string()));
  table.rows.push_back(std::move(row));
}

// Compares octave by octave.
class Comparison {
 public:
  Comparison(const MeasuredRoom& room, const std::vector<AtPairs>& by_seed)
      : room_(room), by_seed_(by_seed) {
    for (const Figures& one : room.figures)
      if (std::ranges::count(names_, one.by) == 0) names_.push_back(one.by);
    for (std::size_t pair = 0; pair < room.pairs(); ++pair) all_pairs_.push_back(pair);
  }

  // Adds a chart, and rows to the table of means.
  void add(const ParameterKind& kind, ReportTable& means, std::vector<Chart>& charts,
           std::string& summary) const {
    const Value measured = mean_by("", kind);
    if (is_empty(measured)) return;
    const auto add_means = [&](const std::string& figure, const Value& values) {
      add_row(means, {kind.name, figure}, values);
    };
    const auto in_jnd = [&](const auto& difference) {
      Value values;
      for (std::size_t b = 0; b < kBandCount; ++b)
        if (const std::optional<double> one = measured[b] ? difference(b) : std::nullopt)
          values[b] = *one / kind.noticeable_at(*measured[b]);
      return values;
    };
    const std::string unit = unit_of(kind);
    Chart chart{.title = kind.name,
                .x_label = "octave band (Hz)",
                .y_label = kind.name + unit,
                .log_x = true,
                .x_ticks = {kBandCentres_hz.begin(), kBandCentres_hz.end()},
                .width = 420,
                .height = 260};
    const auto add_line = [&](const std::string& name, const Value& values, bool is_dashed) {
      using Look = Chart::Series::Look;
      Chart::Series line{.name = name, .look = is_dashed ? Look::kDashes : Look::kLineAndDots};
      for (std::size_t b = 0; b < kBandCount; ++b)
        if (values[b]) line.points.emplace_back(kBandCentres_hz[b], *values[b]);
      chart.series.push_back(std::move(line));
    };

    Value ours, of_seeds, of_pairs;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const auto of_bakes = over_seeds(pairs_of("", kind, b), kind, b);
      std::vector<double> at_pairs;
      for (const std::size_t pair : all_pairs_)
        if (const auto one = over_seeds({pair}, kind, b)) at_pairs.push_back(one->mean);
      const auto over_pairs = spread_of(at_pairs);
      if (!of_bakes || !measured[b]) continue;
      ours[b] = of_bakes->mean, of_seeds[b] = of_bakes->deviation;
      if (over_pairs) of_pairs[b] = over_pairs->deviation;
    }
    add_means("measured" + unit, measured);
    add_line("measured", measured, false);
    const auto compare = [&](const std::string& name, const Value& values, bool is_dashed) {
      const auto difference = in_jnd([&](std::size_t b) {
        return values[b] ? std::optional(*values[b] - *measured[b]) : std::nullopt;
      });
      add_means(name + unit, values);
      add_means(name + " - measured (JND)", difference);
      add_line(name, values, is_dashed);
      std::vector<double> sizes;
      for (std::size_t b = kFirstJudged; b <= kLastJudged; ++b)
        if (difference[b]) sizes.push_back(std::abs(*difference[b]));
      if (!sizes.empty())
        summary += fmt::format("{}{} of {} {:.2f}", summary.empty() ? "" : ", ", kind.name, name,
                               mean_of(sizes));
    };
    compare("Clamor", ours, false);
    add_means("seeds of Clamor (JND)", in_jnd([&](std::size_t b) { return of_seeds[b]; }));
    add_means("pairs of Clamor (JND)", in_jnd([&](std::size_t b) { return of_pairs[b]; }));
    if (std::ranges::count(room_.figures, "", &Figures::by) > 1)
      add_means("pairs measured (JND)", in_jnd([&](std::size_t b) {
                  return std::optional(spread_of(values_by("", kind, b))->deviation);
                }));
    for (const std::string& name : names_)
      if (!name.empty()) compare(name, mean_by(name, kind), true);
    charts.push_back(std::move(chart));
  }

  // Adds rows for one pair: means over the seeds, their deviation, and what was measured there.
  void add_pair(std::size_t pair, const ParameterKind& kind, ReportTable& table) const {
    const std::string unit = unit_of(kind);
    const std::string name = room_.name_of(pair);
    Value ours, of_seeds;
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (const auto of_bakes = over_seeds({pair}, kind, b)) {
        ours[b] = of_bakes->mean;
        of_seeds[b] = of_bakes->deviation / kind.noticeable_at(of_bakes->mean);
      }
    add_row(table, {name, kind.name, "Clamor" + unit}, ours);
    add_row(table, {name, kind.name, "seeds of Clamor (JND)"}, of_seeds);
    for (const Figures& one : room_.figures)
      if (one.pairs == std::vector{pair} && !is_empty(one.values.*kind.value))
        add_row(table, {name, kind.name, (one.by.empty() ? "measured" : one.by) + unit},
                one.values.*kind.value);
  }

 private:
  std::vector<double> values_by(const std::string& by, const ParameterKind& kind,
                                std::size_t b) const {
    std::vector<double> values;
    for (const Figures& one : room_.figures)
      if (const auto& value = (one.values.*kind.value)[b]; one.by == by && value)
        values.push_back(*value);
    return values;
  }

  Value mean_by(const std::string& by, const ParameterKind& kind) const {
    Value means;
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (const auto over = spread_of(values_by(by, kind, b))) means[b] = over->mean;
    return means;
  }

  // The pairs for which there is such a value.
  std::vector<std::size_t> pairs_of(const std::string& by, const ParameterKind& kind,
                                    std::size_t b) const {
    std::vector<std::size_t> pairs;
    for (const Figures& one : room_.figures)
      if (one.by == by && (one.values.*kind.value)[b])
        pairs.insert(pairs.end(), one.pairs.begin(), one.pairs.end());
    return pairs;
  }

  // Of the mean over these pairs, of those that have the parameter.
  std::optional<Spread> over_seeds(const std::vector<std::size_t>& pairs, const ParameterKind& kind,
                                   std::size_t b) const {
    std::vector<double> means;
    for (const AtPairs& at : by_seed_) {
      std::vector<double> values;
      for (const std::size_t pair : pairs)
        if (const auto& value = (at[pair].*kind.value)[b]) values.push_back(*value);
      if (!values.empty()) means.push_back(mean_of(values));
    }
    return spread_of(means);
  }

  const MeasuredRoom& room_;
  const std::vector<AtPairs>& by_seed_;
  std::vector<std::string> names_;  // of those who give figures
  std::vector<std::size_t> all_pairs_;
};

}  // namespace

Result<ReportPage> room_experiment(const ExperimentOptions& options, std::ostream& err) {
  const auto room = read_room(options.level);
  if (!room.ok()) return room.error();
  const OcclusionGeometry surfaces(room->level.mesh, room->level.materials);
  BakeSettings settings;
  settings.longest_path_s = 0;
  settings.air = room->level.air;
  if (options.quick) settings.sources = kQuickRoomSources;
  const int bakes = options.quick ? kQuickBakes : options.bakes;
  std::vector<AtPairs> by_seed;
  for (int seed = 1; seed <= bakes; ++seed) {
    settings.seed = static_cast<std::uint64_t>(seed);
    auto measured = baked_and_measured(*room, surfaces, settings);
    if (!measured.ok()) return measured.error();
    by_seed.push_back(std::move(*measured));
    err << fmt::format("  seed {} of {}\n", seed, bakes);
  }

  std::vector<std::string> octaves;
  for (const double hz : kBandCentres_hz) octaves.push_back(fmt::format("{:g}_hz", hz));
  const auto with_octaves = [&](std::vector<std::string> columns) {
    columns.insert(columns.end(), octaves.begin(), octaves.end());
    return columns;
  };
  ReportTable means{
      "means", "In the mean of what was measured", with_octaves({"parameter", "figure"}), {}},
      pairs{"pairs", "At every pair", with_octaves({"pair", "parameter", "figure"}), {}, true};
  const Comparison comparison(*room, by_seed);
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
