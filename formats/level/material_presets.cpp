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
    auto parsed = parse(kMaterialsJson);
    assert(parsed.ok());  // a test parses the same text
    return parsed.ok() ? *parsed : MaterialPresets();
  }();
  return presets;
}

Result<MaterialPresets> MaterialPresets::parse(std::string_view text) {
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
    const auto reduction_db = eight_values(fields, "sound_reduction_db", 200);
    if (reduction_db)
      for (std::size_t b = 0; b < kBandCount; ++b)
        material.transmission[b] =
            std::min(exp2_of(kLog2PerDecibel * -(*reduction_db)[b]), material.absorption[b]);
    if (const Json* aliases = fields.any("aliases"); aliases != nullptr && aliases->object())
      for (const auto& [language, words] : *aliases->object())
        presets.add_aliases(&words, presets.names_.size());
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
  presets.add_aliases(json->find("not_materials"), MaterialAliases::kNothing);
  return presets;
}

void MaterialPresets::add_aliases(const Json* list, std::size_t preset) {
  if (list == nullptr || list->array() == nullptr) return;
  for (const Json& alias : *list->array())
    if (alias.string() != nullptr) aliases_.add(*alias.string(), preset);
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
