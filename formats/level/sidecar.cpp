#include "formats/level/sidecar.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "formats/level/level_origin.h"

namespace clamor {

namespace {

constexpr double kMaxWhole = 9007199254740992.0;  // 2^53, the limit of exact integers in JSON

Result<ImportedSettings> read_settings(const Json& json) {
  ImportedSettings settings;
  JsonFields fields(json, "settings");
  settings.photons = fields.whole_number("photons", 1, 4e9);
  settings.seed = fields.whole_number("seed", 0, kMaxWhole);
  if (const Json* air = fields.any("air")) {
    const auto read = read_air(*air, "settings: air");
    if (!read.ok()) return read.error();
    settings.air = *read;
  }
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  return settings;
}

// A list of patterns for names; `example` shows one.
std::vector<std::string> read_patterns(JsonFields& fields, const char* key, const char* example) {
  std::vector<std::string> patterns;
  const Json* list = fields.any(key);
  if (list == nullptr) return patterns;
  bool ok = list->array() != nullptr;
  if (ok)
    for (const Json& glob : *list->array()) {
      ok = ok && glob.string() != nullptr && !glob.string()->empty();
      if (ok) patterns.push_back(*glob.string());
    }
  if (!ok)
    fields.fail(fmt::format("'{}' must be a list of patterns, as in [\"{}\"]", key, example));
  return patterns;
}

std::optional<Vec3> read_facing(JsonFields& fields) {
  const auto facing = fields.vector("facing", kMaxEmitterCoordinate_m);
  if (!facing) return std::nullopt;
  if (length(*facing) > 0) return normalize(*facing);
  fields.fail("'facing' is [0, 0, 0], which is no direction");
  return std::nullopt;
}

std::optional<double> read_gain(JsonFields& fields) {
  const Json* const gain = fields.any("gain");
  if (gain == nullptr || gain->string() == nullptr) return fields.number("gain", 0, kMaxGain);
  const auto parsed = parse_gain(*gain->string());
  if (parsed.ok()) return *parsed;
  fields.fail(parsed.error().message);
  return std::nullopt;
}

// An entry with a name and no signal changes an emitter of the level.
bool is_change(const Json& json) {
  return json.find("name") != nullptr && json.find("signal") == nullptr;
}

Result<EmitterChange> read_change(const Json& json, std::size_t index) {
  EmitterChange change;
  JsonFields fields(json, fmt::format("emitter {}", index + 1));
  const auto name = fields.string("name");
  if (!name || name->empty()) fields.fail("'name' must name the emitter of the level to change");
  change.name = name.value_or("");
  change.removed = fields.boolean("removed").value_or(false);
  change.at_m = fields.vector("at", kMaxWorldCoordinate_m);
  change.facing = read_facing(fields);
  change.gain = read_gain(fields);
  change.delay_s = fields.number("delay", 0, kMaxDelay_s);
  change.directivity = bands_member(fields, "directivity", 0, kMaxDirectivity);
  fields.any("comment");
  if (const auto ok = fields.result_without_unknown(); !ok.ok())
    return Error(ok.error().message +
                 " (Without a 'signal', an emitter changes the one of that name in the level.)");
  return change;
}

Result<ListenerSpec> read_listener(const Json& json, std::size_t index) {
  ListenerSpec spec;
  JsonFields fields(json, fmt::format("listener {}", index + 1));
  spec.name = fields.string("name").value_or(fmt::format("listener {}", index + 1));
  const auto at = fields.vector("at", kMaxWorldCoordinate_m);
  if (!at) fields.fail("'at' is missing: give [x, y, z] in metres");
  spec.at_m = at.value_or(Vec3());
  spec.yaw_deg = fields.number("yaw", -360, 360).value_or(0);
  spec.pitch_deg = fields.number("pitch", -90, 90).value_or(0);
  fields.any("comment");
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  return spec;
}

Result<EmitterSpec> read_emitter(const Json& json, std::size_t index) {
  EmitterSpec spec;
  JsonFields fields(json, fmt::format("emitter {}", index + 1));
  spec.name = fields.string("name").value_or("");
  const auto signal = fields.string("signal");
  if (!signal || signal->empty())
    fields.fail(
        "'signal' is missing: give a sound file in the level's folder, or \"impulse\" or "
        "\"noise\"");
  const auto at = fields.vector("at", kMaxWorldCoordinate_m);
  if (!at) fields.fail("'at' is missing: give [x, y, z] in metres");
  spec.facing = read_facing(fields).value_or(spec.facing);
  spec.gain = read_gain(fields).value_or(1);
  spec.directivity = bands_member(fields, "directivity", 0, kMaxDirectivity).value_or(Bands{});
  spec.delay_s = fields.number("delay", 0, kMaxDelay_s).value_or(0);
  spec.random_delay_s = fields.number("random_delay", 0, kMaxDelay_s).value_or(0);
  spec.loop = fields.boolean("loop");
  fields.any("comment");
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  spec.signal = *signal;
  spec.at_m = *at;
  return spec;
}

Result<std::vector<Vec3>> read_probes(const Json& json) {
  if (json.array() == nullptr)
    return Error("'probes' must be a list, [ { \"at\": [x, y, z] }, ... ].");
  std::vector<Vec3> probes_m;
  for (const Json& probe : *json.array()) {
    JsonFields fields(probe, fmt::format("probe {}", probes_m.size() + 1));
    const auto at = fields.vector("at", kMaxWorldCoordinate_m);
    if (!at) fields.fail("'at' is missing: give [x, y, z] in metres");
    for (const char* note : {"name", "comment"}) fields.any(note);
    if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
    probes_m.push_back(*at);
  }
  return probes_m;
}

Result<PortalSpec> read_portal(const Json& json, std::size_t index) {
  JsonFields fields(json, fmt::format("portal {}", index + 1));
  const auto name = fields.string("name");
  const auto at = fields.vector("at", kMaxWorldCoordinate_m);
  if (!at) fields.fail("'at' is missing: give [x, y, z] in metres, its centre");
  const auto facing = fields.vector("facing", kMaxEmitterCoordinate_m);
  if (!facing || !(length(*facing) > 0))
    fields.fail("'facing' is missing or zero: give the direction that sound passes in, as in [1, 0, 0]");
  const auto size = fields.numbers("size");
  constexpr double kMinSide_m = 0.01, kMaxSide_m = 1e5;
  if (!size || size->size() != 2 ||
      !(std::min((*size)[0], (*size)[1]) >= kMinSide_m &&
        std::max((*size)[0], (*size)[1]) <= kMaxSide_m))
    fields.fail("'size' must be [width, height] in metres, each 0.01 to 100000");
  PortalSpec spec;
  const bool is_baked_closed = read_baked_states(fields, spec.material);
  spec.parts = read_portal_parts(fields);
  fields.any("comment");
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  spec.portal = facing_portal(*at, *facing, (*size)[0], (*size)[1]);
  spec.portal.name = name.value_or("");
  spec.portal.is_baked_closed = is_baked_closed;
  return spec;
}

Result<std::vector<PortalSpec>> read_portals(const Json& json) {
  if (json.array() == nullptr)
    return Error(
        "'portals' must be a list, [ { \"at\": [x, y, z], \"size\": [width, height], \"facing\": "
        "[x, y, z] }, ... ].");
  std::vector<PortalSpec> portals;
  for (const Json& one : *json.array()) {
    auto portal = read_portal(one, portals.size());
    if (!portal.ok()) return portal.error();
    portals.push_back(std::move(*portal));
  }
  return portals;
}

}  // namespace

bool read_baked_states(JsonFields& fields, std::string& material) {
  const auto baked = fields.string("baked");
  const auto preset = fields.string("material");
  const bool is_baked_closed = baked && *baked == "both";
  if (baked && !is_baked_closed && *baked != "open")
    fields.fail("'baked' must be \"open\" or \"both\"");
  if (preset && !is_baked_closed)
    fields.fail("'material' is that of the closed portal, and needs \"baked\": \"both\"");
  material = preset.value_or("wood");
  return is_baked_closed;
}

PartPatterns read_portal_parts(JsonFields& fields) {
  if (fields.any("parts") == nullptr) return std::nullopt;
  return read_patterns(fields, "parts", "Door_Leaf*");
}

Result<Sidecar> parse_sidecar(std::string_view text, const MaterialPresets& presets) {
  auto json = parse_json(text);
  if (!json.ok()) return Error(json.error().message + ".");
  shorten_names(*json);
  Sidecar sidecar;
  JsonFields fields(*json, "sidecar");
  for (const char* note : {"$schema", "comment"}) fields.any(note);

  if (const Json* materials = fields.any("materials")) {
    if (materials->object() == nullptr)
      return Error("'materials' must be an object of patterns, as in { \"brick*\": \"brick\" }.");
    for (const auto& [pattern, values] : *materials->object()) {
      auto acoustics = read_acoustic_material(values, pattern, presets);
      if (!acoustics.ok()) return acoustics.error();
      sidecar.materials.push_back({pattern, std::move(*acoustics)});
    }
  }
  if (const Json* emitters = fields.any("emitters")) {
    if (emitters->array() == nullptr) return Error("'emitters' must be a list, [ { ... }, ... ].");
    for (std::size_t i = 0; i < emitters->array()->size(); ++i) {
      const Json& emitter = (*emitters->array())[i];
      if (is_change(emitter)) {
        auto change = read_change(emitter, i);
        if (!change.ok()) return change.error();
        sidecar.emitter_changes.push_back(std::move(*change));
        continue;
      }
      auto spec = read_emitter(emitter, i);
      if (!spec.ok()) return spec.error();
      sidecar.emitters.push_back(std::move(*spec));
    }
  }
  if (const Json* listeners = fields.any("listeners")) {
    if (listeners->array() == nullptr)
      return Error("'listeners' must be a list, [ { \"at\": [x, y, z] }, ... ].");
    for (const Json& listener : *listeners->array()) {
      auto spec = read_listener(listener, sidecar.listeners.size());
      if (!spec.ok()) return spec.error();
      sidecar.listeners.push_back(std::move(*spec));
    }
  }
  if (const Json* probes = fields.any("probes")) {
    auto read = read_probes(*probes);
    if (!read.ok()) return read.error();
    sidecar.probes_m = std::move(*read);
  }
  sidecar.movable = read_patterns(fields, "movable", "Door*");
  sidecar.surfaces.ignored = read_patterns(fields, "ignored", "UCX_*");
  sidecar.surfaces.kept = read_patterns(fields, "kept", "Sky_Ceiling");
  if (const Json* portals = fields.any("portals")) {
    auto read = read_portals(*portals);
    if (!read.ok()) return read.error();
    sidecar.portals = std::move(*read);
  }
  if (const Json* settings = fields.any("settings")) {
    auto read = read_settings(*settings);
    if (!read.ok()) return read.error();
    sidecar.settings = *read;
  }
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  return sidecar;
}

}  // namespace clamor
