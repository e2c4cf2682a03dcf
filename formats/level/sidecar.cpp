#include "formats/level/sidecar.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace clamor {

namespace {

constexpr double kMaxWhole = 9007199254740992.0;  // 2^53, the limit of exact integers in JSON

constexpr const char* kMovableIsAList =
    "'movable' must be a list of patterns for names of nodes, as in [\"Door*\"].";

std::optional<std::uint64_t> whole_number(JsonFields& fields, const char* key, double low) {
  const auto value = fields.number(key, low, kMaxWhole);
  if (!value) return std::nullopt;
  if (std::floor(*value) != *value) fields.fail(in_quotes(key) + " must be a whole number");
  return static_cast<std::uint64_t>(*value);
}

Result<ImportedSettings> read_settings(const Json& json) {
  ImportedSettings settings;
  JsonFields fields(json, "settings");
  settings.photons = whole_number(fields, "photons", 1);
  settings.seed = whole_number(fields, "seed", 0);
  if (const Json* air = fields.any("air")) {
    JsonFields values(*air, "settings: air");
    Air result;
    // Slightly more than the range for which ISO 9613-1 states its accuracy.
    result.temperature_c = values.number("temperature_c", -60, 80).value_or(result.temperature_c);
    result.humidity_percent =
        values.number("humidity_percent", 0, 100).value_or(result.humidity_percent);
    result.pressure_kpa = values.number("pressure_kpa", 10, 200).value_or(result.pressure_kpa);
    if (const auto ok = values.result_without_unknown(); !ok.ok()) return ok.error();
    settings.air = result;
  }
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  return settings;
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
  const auto at = fields.vector("at", kMaxEmitterCoordinate_m);
  if (!at) fields.fail("'at' is missing: give [x, y, z] in metres");
  if (const auto facing = fields.vector("facing", kMaxEmitterCoordinate_m)) {
    if (length(*facing) > 0)
      spec.facing = normalize(*facing);
    else
      fields.fail("'facing' is [0, 0, 0], which is no direction");
  }
  if (const Json* gain = fields.any("gain"); gain != nullptr && gain->string() != nullptr) {
    const auto parsed = parse_gain(*gain->string());
    if (parsed.ok())
      spec.gain = *parsed;
    else
      fields.fail(parsed.error().message);
  } else {
    spec.gain = fields.number("gain", 0, kMaxGain).value_or(1);
  }
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
    const auto at = fields.vector("at", kMaxEmitterCoordinate_m);
    if (!at) fields.fail("'at' is missing: give [x, y, z] in metres");
    for (const char* note : {"name", "comment"}) fields.any(note);
    if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
    probes_m.push_back(*at);
  }
  return probes_m;
}

// A side of the rectangle is horizontal, unless the portal faces up or down: then it is along x.
Portal facing_portal(const Vec3& at_m, const Vec3& facing, double width_m, double height_m) {
  Portal portal;
  const Vec3 normal = normalize(facing), across = cross(Vec3(0, 1, 0), normal);
  const Vec3 u =
      length(across) > 1e-3 ? normalize(across) : normalize(Vec3(1, 0, 0) - normal * normal.x);
  portal.centre_m = at_m;
  portal.half_u_m = u * (width_m / 2);
  portal.half_v_m = cross(normal, u) * (height_m / 2);
  return portal;
}

Result<PortalSpec> read_portal(const Json& json, std::size_t index) {
  JsonFields fields(json, fmt::format("portal {}", index + 1));
  const auto name = fields.string("name");
  const auto at = fields.vector("at", kMaxEmitterCoordinate_m);
  if (!at) fields.fail("'at' is missing: give [x, y, z] in metres, its centre");
  const auto facing = fields.vector("facing", kMaxEmitterCoordinate_m);
  if (!facing || !(length(*facing) > 0))
    fields.fail("'facing' is missing: give the direction that sound passes in, as in [1, 0, 0]");
  const auto size = fields.numbers("size");
  constexpr double kMinSide_m = 0.01, kMaxSide_m = 1e5;
  if (!size || size->size() != 2 ||
      !(std::min((*size)[0], (*size)[1]) >= kMinSide_m &&
        std::max((*size)[0], (*size)[1]) <= kMaxSide_m))
    fields.fail("'size' must be [width, height] in metres, each 0.01 to 100000");
  PortalSpec spec;
  const bool is_baked_closed = read_baked_states(fields, spec.material);
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

Result<Sidecar> parse_sidecar(std::string_view text, const MaterialPresets& presets) {
  const auto json = parse_json(text);
  if (!json.ok()) return Error(json.error().message + ".");
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
    for (const Json& emitter : *emitters->array()) {
      auto spec = read_emitter(emitter, sidecar.emitters.size());
      if (!spec.ok()) return spec.error();
      sidecar.emitters.push_back(std::move(*spec));
    }
  }
  if (const Json* probes = fields.any("probes")) {
    auto read = read_probes(*probes);
    if (!read.ok()) return read.error();
    sidecar.probes_m = std::move(*read);
  }
  if (const Json* movable = fields.any("movable")) {
    if (movable->array() == nullptr) return Error(kMovableIsAList);
    for (const Json& glob : *movable->array()) {
      if (glob.string() == nullptr || glob.string()->empty()) return Error(kMovableIsAList);
      sidecar.movable.push_back(*glob.string());
    }
  }
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
