#include "formats/level/sidecar.h"

#include <cmath>

#include <fmt/format.h>

namespace clamor {

namespace {

constexpr double kMaxWhole = 9007199254740992.0;  // 2^53, the limit of exact integers in JSON

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

}  // namespace

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
  if (const Json* settings = fields.any("settings")) {
    auto read = read_settings(*settings);
    if (!read.ok()) return read.error();
    sidecar.settings = *read;
  }
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  return sidecar;
}

}  // namespace clamor
