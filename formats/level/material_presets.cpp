#include "formats/level/material_presets.h"

#include <algorithm>

#include "common/maths.h"
#include "common/text.h"
#include "embedded_materials.h"
#include "formats/files/json.h"

namespace clamor {

namespace {

constexpr float kLog2PerDecibel = 0.332192809f;  // of a power

std::optional<Bands> eight_values(JsonFields& fields, const char* key, double high) {
  const auto values = fields.numbers(key);
  if (!values) return std::nullopt;
  Bands bands = same_in_all_bands(static_cast<float>(values->front()));
  if (values->size() == kBandCount) std::copy(values->begin(), values->end(), bands.begin());
  const bool in_range =
      std::all_of(values->begin(), values->end(), [&](double v) { return v >= 0 && v <= high; });
  if (!in_range || (values->size() != 1 && values->size() != kBandCount))
    fields.fail(in_quotes(key) + " must be 1 or 8 values in range");
  return bands;
}

// Mean absorption from 500 to 2000 Hz from which on a material counts as one that absorbs.
constexpr float kAbsorbs = 0.2f;

}  // namespace

const MaterialPresets& MaterialPresets::built_in() {
  static const MaterialPresets presets = [] {
    auto parsed = parse(kMaterialsJson, kMaterialNames);
    assert(parsed.ok());  // a test parses the same texts
    return parsed.ok() ? std::move(*parsed) : MaterialPresets();
  }();
  return presets;
}

Result<MaterialPresets> MaterialPresets::parse(std::string_view text, std::string_view names) {
  const auto json = parse_json(text);
  if (!json.ok()) return json.error();
  const Json* materials = json->find("materials");
  if (materials == nullptr || materials->object() == nullptr)
    return Error("has no object 'materials'.");

  MaterialPresets presets;
  for (const auto& [name, values] : *materials->object()) {
    JsonFields fields(values, "preset " + in_quotes(name));
    Material material;
    material.name = name;
    const auto absorption = eight_values(fields, "absorption", 1);
    const auto scattering = eight_values(fields, "scattering", 1);
    if (!absorption || !scattering) fields.fail("needs 'absorption' and 'scattering'");
    material.absorption = absorption.value_or(Bands{});
    material.scattering = scattering.value_or(Bands{});
    if (const auto phong = eight_values(fields, "phong", kMirrorExponent)) material.phong = *phong;
    material.rows_m = static_cast<float>(fields.number("rows_m", 0, kDeepestRows_m).value_or(0));
    const auto reduction_db = eight_values(fields, "sound_reduction_db", 200);
    if (reduction_db)
      for (std::size_t b = 0; b < kBandCount; ++b)
        material.transmission[b] =
            std::min(exp2_of(kLog2PerDecibel * -(*reduction_db)[b]), material.absorption[b]);
    Origin origin{.source = fields.string("source").value_or(""),
                  .reduction_db = reduction_db,
                  .reduction_source = fields.string("sound_reduction_source").value_or("")};
    if (const auto range = fields.numbers("measured_hz"); range && range->size() == 2) {
      origin.low_hz = (*range)[0];
      origin.high_hz = (*range)[1];
    }
    if (const auto ok = fields.result(); !ok.ok()) return ok.error();
    presets.origins_.push_back(std::move(origin));
    presets.names_.push_back(name);
    presets.absorbs_.push_back(
        (material.absorption[3] + material.absorption[4] + material.absorption[5]) / 3 >= kAbsorbs);
    presets.materials_.push_back(material);
  }
  if (const auto added = presets.add_aliases(names); !added.ok()) return added.error();
  return presets;
}

Result<void> MaterialPresets::add_aliases(std::string_view names) {
  // The text before the first `separator`, which is removed.
  const auto take = [](std::string_view& text, std::string_view separator) {
    const std::size_t end = std::min(text.find(separator), text.size());
    const std::string_view taken = text.substr(0, end);
    text.remove_prefix(std::min(end + separator.size(), text.size()));
    return taken;
  };
  std::size_t preset = MaterialAliases::kNothing;
  while (!names.empty()) {
    std::string_view line = take(names, "\n");
    if (line.starts_with(' ')) {
      take(line, ": ");
      while (!line.empty()) aliases_.add(take(line, ", "), preset);
    } else if (line == "-") {
      preset = MaterialAliases::kNothing;
    } else if (!line.empty() && !line.starts_with('#')) {
      const auto it = std::find(names_.begin(), names_.end(), line);
      if (it == names_.end()) return Error("there is no preset " + in_quotes(line));
      preset = static_cast<std::size_t>(it - names_.begin());
    }
  }
  return {};
}

Result<Material> MaterialPresets::get(std::string_view name) const {
  const auto it = std::find(names_.begin(), names_.end(), name);
  if (it != names_.end()) return materials_[static_cast<std::size_t>(it - names_.begin())];
  if (const auto meant = guess(name); !meant.preset.empty())
    return Error("there is no preset " + in_quotes(name) + "; the preset for it is " +
                 in_quotes(meant.preset) + ". 'clamor materials' lists all of them.");
  return Error("there is no preset " + in_quotes(name) + "; the nearest name is " +
               in_quotes(nearest_name(name, names_)) + ". 'clamor materials' lists all of them.");
}

NameGuess MaterialPresets::guess(std::string_view material_name) const {
  const auto match = aliases_.find(material_name, absorbs_);
  if (match.preset == MaterialAliases::kNothing) return {};
  return {names_[match.preset], match.doubt ? names_[*match.doubt] : ""};
}

}  // namespace clamor
