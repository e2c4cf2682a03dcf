#include "tools/report/report_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include <fmt/format.h>

#include "bake/report/lost_power.h"
#include "common/sample_rate.h"
#include "common/utf8_path.h"
#include "runtime/response/impulse_response.h"
#include "tools/analysis/json_values.h"
#include "tools/program/text_format.h"
#include "tools/report/bake_json.h"
#include "tools/report/level_findings.h"
#include "tools/report/room_summary.h"
#include "tools/report/view_json.h"

namespace clamor {

namespace {

constexpr int kDecaySteps = 120;
constexpr std::size_t kEchoBand = 4;  // 1 kHz
constexpr double kEchogram_s = 0.3, kEchoBin_s = 0.002;
constexpr double kWaveform_s = 0.25;
constexpr std::size_t kWaveformColumns = 500;

std::string file_name(const BakeFile& file) { return path_of(file.path()).filename().string(); }

// Levels of each octave at equal steps, until the slowest has decayed by 60 dB.
OrderedJson decay_of(std::span<const Arrival> arrivals) {
  std::array<std::optional<DecayCurve>, kBandCount> curves;
  double end_s = 0.05;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    curves[b] = energy_decay(arrivals, b);
    if (!curves[b]) continue;
    for (double t_s = 0.05; t_s < 20 && curves[b]->level_db(t_s) > -60; t_s *= 1.03)
      end_s = std::max(end_s, t_s);
  }
  std::vector<float> levels_db;
  for (const auto& curve : curves)
    for (int i = 0; i <= kDecaySteps; ++i)
      levels_db.push_back(curve ? static_cast<float>(curve->level_db(end_s * i / kDecaySteps))
                                : -std::numeric_limits<float>::infinity());
  return {{"end_s", end_s}, {"levels_db", column(levels_db)}};
}

// Energy after the direct sound in short bins, as shares of all of it.
OrderedJson echogram_of(std::span<const Arrival> arrivals) {
  std::vector<double> bins(static_cast<std::size_t>(std::lround(kEchogram_s / kEchoBin_s)), 0);
  double all = 0;
  for (const Arrival& arrival : arrivals) {
    const double energy = arrival.energy[kEchoBand];
    all += energy;
    const double t_s = arrival.time_s - arrivals.front().time_s;
    if (const auto bin = static_cast<std::size_t>(t_s / kEchoBin_s); bin < bins.size())
      bins[bin] += energy;
  }
  std::vector<float> shares;
  for (const double energy : bins) shares.push_back(static_cast<float>(energy / all));
  return {{"bin_ms", 1e3 * kEchoBin_s}, {"shares", column(shares)}};
}

// The lowest and the highest sample of each column of a picture.
OrderedJson waveform_of(std::span<const Arrival> arrivals) {
  const auto first =
      static_cast<std::size_t>(std::max(0.0, arrivals.front().time_s - 0.01) * kSampleRate_hz);
  const auto wide = static_cast<std::size_t>(kWaveform_s * kSampleRate_hz);
  const std::vector<float> samples = impulse_response(arrivals, wide, first);
  std::vector<float> extremes;
  for (std::size_t c = 0; c < kWaveformColumns; ++c) {
    const auto at = [&](std::size_t column) {
      return samples.begin() + static_cast<std::ptrdiff_t>(column * wide / kWaveformColumns);
    };
    const auto [low, high] = std::minmax_element(at(c), at(c + 1));
    extremes.insert(extremes.end(), {*low, *high});
  }
  return {{"from_ms", 1e3 * static_cast<double>(first) / kSampleRate_hz},
          {"length_ms", 1e3 * kWaveform_s},
          {"extremes", column(extremes)}};
}

// Figures of all listeners, in the octaves that a summary judges by.
OrderedJson middle_of(const std::vector<RoomResponse>& responses) {
  OrderedJson json;
  for (const ParameterKind& kind : kParameterKinds)
    json[kind.key] = as_json(middle_value(responses, kind));
  return json;
}

OrderedJson listeners_of(const MeasuredRoom& measured) {
  OrderedJson list = OrderedJson::array();
  for (const RoomResponse& response : measured.responses) {
    OrderedJson one = {{"place_m", as_json(response.listener_m)},
                       {"sources", response.sources},
                       {"parameters", response.parameters},
                       {"t30_middle_s", as_json(middle_value({&response, 1}, kind_of("T30")))}};
    if (!response.arrivals.empty()) {
      one["decay"] = decay_of(response.arrivals);
      one["echogram"] = echogram_of(response.arrivals);
      one["waveform"] = waveform_of(response.arrivals);
    }
    list.push_back(std::move(one));
  }
  return list;
}

OrderedJson materials_of(std::span<const MetMaterial> materials) {
  OrderedJson list = OrderedJson::array();
  for (const MetMaterial& material : materials) {
    std::array<double, kBandCount> dissipated{};
    for (std::size_t b = 0; b < kBandCount; ++b) dissipated[b] = material.dissipated(b);
    list.push_back({{"name", material.name},
                    {"absorption", material.absorption},
                    {"arrived", material.arrived},
                    {"dissipated", dissipated}});
  }
  return list;
}

// Adds what clamor inspect prints: its JSON without the emitters, and two of its tables.
Result<void> add_bake(const BakeFile& file, OrderedJson& json) {
  const auto overview = overview_of(file);
  if (!overview.ok()) return overview.error();
  json["setting"] = fmt::format(
      "{}: {} and {}, made by {}", file_name(file), counted(overview->emitter_count, "emitter"),
      counted(overview->secondary, "secondary source"), file.provenance().tool);
  auto bake = bake_json(file, *overview, false);
  if (!bake.ok()) return bake.error();
  bake->erase("emitters");
  json["bake"] = std::move(*bake);
  for (const BandRow& row : acoustic_rows(file, *overview)) {
    OrderedJson cells = row.texts;
    cells.insert(cells.begin(), row.title);
    json["acoustics"].push_back(std::move(cells));
  }
  for (const MakingLine& line : making_lines(file, *overview))
    json["making"].push_back({line.title, line.text});
  return {};
}

}  // namespace

Result<OrderedJson> report_document(const ReportContents& contents) {
  const auto& [measured, other, map, map_at_first] = contents;
  const BakeFile& file = measured.file();
  const BakeStatistics& statistics = file.statistics();
  const std::vector<MetMaterial> materials = met_materials(file);
  const Excitation& excitation = measured.meter->excitation();
  const Enclosure enclosure = enclosure_of(statistics.findings);
  OrderedJson json = {{"title", "How " + file.provenance().level + " sounds"}};
  if (const auto added = add_bake(file, json); !added.ok()) return added.error();
  json["bands_hz"] = kBandCentres_hz;
  for (const ParameterKind& kind : kParameterKinds)
    json["kinds"].push_back({{"key", kind.key},
                             {"name", kind.name},
                             {"unit", kind.unit},
                             {"digits", kind.digits},
                             {"noticeable", kind.noticeable},
                             {"is_share", kind.is_share}});
  json["file"] = file_name(file);
  json["excitation"] = excitation.words;
  json["is_crowd"] = !excitation.emitter;
  json["is_mostly_open"] = enclosure == Enclosure::kMostlyOpen;
  json["lost_ways"] = ways_of(lost_power(statistics, file.materials()));
  json["described"] = described(measured.responses, enclosure, !excitation.emitter);
  json["cause"] = cause_of_decay(measured.responses, materials);
  json["middle"] = middle_of(measured.responses);
  json["bass_ratio"] = as_json(bass_ratio(measured.responses));
  json["listeners"] = listeners_of(measured);
  if (other) {
    json["other"] = {{"file", file_name(other->file())}, {"middle", middle_of(other->responses)}};
    for (const RoomResponse& response : other->responses)
      json["other"]["listeners"].push_back({{"parameters", response.parameters}});
  }
  json["materials"] = materials_of(materials);
  json["map_sources"] = map.sources;
  if (map_at_first) json["map_at_first"] = *map_at_first;
  std::vector<Vec3> listeners_m;
  for (const RoomResponse& response : measured.responses)
    listeners_m.push_back(response.listener_m - file.origin_m());
  auto level = view_json(measured.meter->room(), findings_of(statistics), map, listeners_m);
  if (!level.ok()) return level.error();
  json["level"] = std::move(*level);
  return json;
}

}  // namespace clamor
