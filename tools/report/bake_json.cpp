#include "tools/report/bake_json.h"

#include <cmath>

#include <fmt/format.h>

#include "bake/report/lost_power.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/image_source.h"
#include "formats/level/movable_part.h"
#include "runtime/engine/signal_store.h"
#include "tools/analysis/json_values.h"
#include "tools/report/room_summary.h"

namespace clamor {

namespace {

// A number in thousandths, or null.
OrderedJson positive_or_null(float value) {
  if (!(value > 0)) return nullptr;
  return std::round(static_cast<double>(value) * 1e3) / 1e3;
}

double ratio(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

OrderedJson what_it_is(const BakeFile& file, const BakeOverview& overview) {
  const BakeBytes bytes = file.bytes();
  OrderedJson json;
  json["format"] = {{"major", file.major()}, {"minor", file.minor()}};
  json["bands_hz"] = OrderedJson::array();
  for (const double hz : kBandCentres_hz) json["bands_hz"].push_back(static_cast<int>(hz));
  json["sources"] = {{"total", file.source_count()},
                     {"stored", file.stored_sources()},
                     {"emitters", overview.emitter_count},
                     {"secondary", overview.secondary}};
  json["bytes"] = {{"file", bytes.file},
                   {"pages", bytes.pages},
                   {"root", bytes.root},
                   {"signals", bytes.signals},
                   {"geometry", bytes.geometry},
                   {"pages_unpacked", bytes.pages_unpacked},
                   {"signals_decoded", decoded_sounds_bytes(file)},
                   {"pages_per_source", ratio(bytes.pages, file.stored_sources())},
                   {"file_per_source", ratio(bytes.file, file.stored_sources())},
                   {"compression_ratio", ratio(bytes.pages_unpacked, bytes.pages)}};
  json["page_count"] = file.page_count();
  std::uint64_t vertices = 0, triangles = 0;
  for (std::size_t i = 0; i < file.geometry_page_count(); ++i) {
    vertices += file.geometry_page(i).vertices;
    triangles += file.geometry_page(i).triangles;
  }
  json["geometry"] = {
      {"triangles", triangles}, {"vertices", vertices}, {"page_count", file.geometry_page_count()}};
  return json;
}

void add_making(const BakeFile& file, const BakeOverview& overview, OrderedJson& json) {
  const BakeSettings& settings = file.settings();
  const BakeStatistics& statistics = file.statistics();
  json["photons"] = {
      {"traced", statistics.photons_traced}, {"escaped_share", escaped_share(statistics)},
      {"bounces", statistics.bounces},       {"deposits", statistics.deposits},
      {"rooms", statistics.rooms},           {"mean_free_path_m", statistics.mean_free_path_m}};
  json["settings"] = {{"seed", settings.seed},
                      {"photons", settings.photons},
                      {"sources", settings.sources},
                      {"roulette_kappa", settings.roulette_exponent},
                      {"early_order", settings.early_order},
                      {"longest_path_s", settings.longest_path_s},
                      {"temperature_c", settings.air.temperature_c},
                      {"humidity_percent", settings.air.humidity_percent},
                      {"pressure_kpa", settings.air.pressure_kpa}};
  json["provenance"] = {{"tool", file.provenance().tool},
                        {"level", file.provenance().level},
                        {"input_hash", fmt::format("{:016x}", file.provenance().input_hash)},
                        {"libraries", file.provenance().libraries},
                        {"command", overview.command}};
  if (overview.command.empty()) json["provenance"]["command"] = nullptr;
  json["provenance"]["inputs"] = OrderedJson::array();
  for (const InputFile& input : file.provenance().inputs)
    json["provenance"]["inputs"].push_back({{"name", input.name},
                                            {"bytes", input.bytes},
                                            {"hash", fmt::format("{:016x}", input.hash)}});
}

void add_sound(const BakeFile& file, const BakeOverview& overview, OrderedJson& json) {
  const BakeStatistics& statistics = file.statistics();
  const LostPower lost = lost_power(statistics, file.materials());
  json["power"] = {
      {"emitted", statistics.power_emitted},       {"in_sources", overview.power},
      {"escaped", statistics.power_escaped},       {"unfinished", statistics.power_unfinished},
      {"through_openings", lost.through_openings}, {"through_walls", lost.through_walls}};
  const DecaySummary& decay = statistics.decay;
  json["decay"] = {{"places", decay.places}, {"error_db", positive_or_null(decay.error_db)}};
  for (const char* key : {"t30_s", "t30_error_s"}) json["decay"][key] = OrderedJson::array();
  for (std::size_t b = 0; b < kBandCount; ++b) {
    json["decay"]["t30_s"].push_back(positive_or_null(decay.t30_s[b]));
    json["decay"]["t30_error_s"].push_back(positive_or_null(decay.t30_error_s[b]));
  }
  json["decay"]["materials"] = OrderedJson::array();
  for (const DecidingMaterial& material : deciding_materials(file))
    json["decay"]["materials"].push_back(
        {{"name", material.name}, {"t30_slope_s", material.slope_s}});
}

void add_tables(const BakeFile& file, OrderedJson& json) {
  const Vec3& origin_m = file.origin_m();
  json["origin_m"] = as_json(origin_m);
  json["materials"] = OrderedJson::array();
  for (const Material& material : file.materials()) {
    json["materials"].push_back({{"name", material.name},
                                 {"absorption", material.absorption},
                                 {"scattering", material.scattering},
                                 {"phong", material.phong},
                                 {"transmission", material.transmission}});
    if (material.rows_m > 0) json["materials"].back()["rows_m"] = material.rows_m;
  }
  json["emitters"] = OrderedJson::array();
  for (const Emitter& emitter : file.emitters())
    json["emitters"].push_back({{"name", emitter.name},
                                {"position_m", as_json(emitter.position_m + origin_m)},
                                {"axis", as_json(emitter.axis)},
                                {"gain", emitter.gain},
                                {"directivity", emitter.directivity},
                                {"signal", emitter.signal},
                                {"delay_s", emitter.delay_s}});
  json["images"] = file.images().size();
  std::uint64_t early = 0, late = 0;
  for (const StoredProbe& probe : file.probes().places) early += probe.tree.top.sources_below;
  for (const StoredTree& zone : file.probes().zones) late += zone.top.sources_below;
  json["probes"] = {{"places", OrderedJson::array()},
                    {"zones", file.probes().zones.size()},
                    {"early_sources", early},
                    {"late_sources", late},
                    {"bytes", file.bytes().probes}};
  for (const StoredProbe& probe : file.probes().places)
    json["probes"]["places"].push_back(as_json(probe.position_m + origin_m));
  json["movable_parts"] = OrderedJson::array();
  for (const MovablePart& part : file.movable_parts()) {
    const PartPose& pose = part.rest_pose;
    json["movable_parts"].push_back(
        {{"name", part.name},
         {"triangles", part.mesh.triangles.size()},
         {"vertices", part.mesh.vertices_m.size()},
         {"position_m", as_json(pose.position_m + origin_m)},
         {"rotation", {pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w}},
         {"scale", pose.scale}});
  }
  const BakedPortals& baked = file.portals();
  json["portals"] = {{"list", OrderedJson::array()},
                     {"sets", baked.sets.size()},
                     {"virtual_emitters", baked.emitters.size()}};
  for (const Portal& portal : baked.portals)
    json["portals"]["list"].push_back({{"name", portal.name},
                                       {"centre_m", as_json(portal.centre_m + origin_m)},
                                       {"half_u_m", as_json(portal.half_u_m)},
                                       {"half_v_m", as_json(portal.half_v_m)},
                                       {"parts", portal.parts}});
}

OrderedJson depth_json(const OctreeDepth& level, const Bands& all) {
  Bands share{};
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (all[b] > 0) share[b] = level.power[b] / all[b];
  return {{"nodes", level.nodes},
          {"sources", level.sources},
          {"packed_bytes", level.packed_bytes},
          {"power", level.power},
          {"power_share", share}};
}

void add_octree(const BakeOverview& overview, OrderedJson& json) {
  json["octree"] = OrderedJson::array();
  for (const OctreeDepth& level : overview.depths)
    json["octree"].push_back(depth_json(level, overview.power));
  json["instanced"] = depth_json(overview.instanced.stored, overview.power);
  json["instanced"]["trees"] = overview.instanced.trees;
}

void add_findings(const LevelFindings& found, OrderedJson& json) {
  auto list = OrderedJson::array();
  for (const LevelFinding& finding : found.list) {
    auto place = OrderedJson();
    if (finding.place_m) place = as_json(*finding.place_m);
    list.push_back({{"kind", finding.kind == LevelFinding::Kind::kOpening ? "opening" : "gap"},
                    {"text", finding.text},
                    {"place_m", place},
                    {"size_m", finding.size_m}});
  }
  json["findings"] = {
      {"closedness", found.closedness}, {"thin_gaps", found.thin_gaps}, {"list", list}};
}

Result<void> add_pages(const BakeFile& file, OrderedJson& json) {
  json["geometry_pages"] = OrderedJson::array();
  for (std::size_t i = 0; i < file.geometry_page_count(); ++i) {
    const GeometryPageInfo page = file.geometry_page(i);
    json["geometry_pages"].push_back({{"offset", page.offset},
                                      {"packed_bytes", page.packed_bytes},
                                      {"triangles", page.triangles},
                                      {"vertices", page.vertices}});
  }
  json["pages"] = OrderedJson::array();
  return file.for_each_page([&](const PageEntry& entry, const OctreePage& page, std::size_t tree,
                                std::size_t depth) -> Result<void> {
    json["pages"].push_back({{"tree", tree},
                             {"depth", depth},
                             {"offset", entry.page.offset},
                             {"packed_bytes", entry.page.bytes()},
                             {"sources", entry.source_count},
                             {"children", page.links.children.size()},
                             {"instances", page.links.instances.size()}});
    return {};
  });
}

}  // namespace

Result<OrderedJson> bake_json(const BakeFile& file, const BakeOverview& overview, bool pages) {
  OrderedJson json = what_it_is(file, overview);
  add_making(file, overview, json);
  add_sound(file, overview, json);
  add_tables(file, json);
  add_octree(overview, json);
  json["warnings"] = file.statistics().warnings;
  add_findings(file.statistics().findings, json);
  if (pages)
    if (const auto added = add_pages(file, json); !added.ok()) return added.error();
  return json;
}

}  // namespace clamor
