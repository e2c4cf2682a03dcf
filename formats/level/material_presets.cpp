#include "formats/level/material_presets.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <tuple>

#include "common/text.h"
#include "embedded_materials.h"
#include "formats/files/json.h"
#include "formats/level/name_match.h"

namespace clamor {

namespace {

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

// Matches plurals: "walls" and "arches" match "wall" and "arch".
bool word_matches(const std::string& pattern, std::string_view word) {
  if (glob_matches(pattern, word)) return true;
  for (const std::string_view plural : {"s", "es"})
    if (word.ends_with(plural) &&
        glob_matches(pattern, word.substr(0, word.size() - plural.size())))
      return true;
  return false;
}

bool words_match(const std::vector<std::string>& pattern, const std::vector<std::string>& words,
                 std::size_t first) {
  if (first + pattern.size() > words.size()) return false;
  for (std::size_t i = 0; i < pattern.size(); ++i)
    if (!word_matches(pattern[i], words[first + i])) return false;
  return true;
}

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
            std::min(std::pow(10.0f, (*reduction_db)[b] / -10), material.absorption[b]);
    if (const Json* aliases = fields.any("aliases"); aliases != nullptr && aliases->array())
      for (const Json& alias : *aliases->array()) {
        if (alias.string() == nullptr) {
          fields.fail("'aliases' must be texts");
          continue;
        }
        const bool substance = !alias.string()->starts_with('~');
        std::istringstream words(alias.string()->substr(substance ? 0 : 1));
        Alias parsed{{}, presets.names_.size(), substance};
        for (std::string word; words >> word;) parsed.words.push_back(word);
        presets.aliases_.push_back(std::move(parsed));
      }
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
    presets.materials_.push_back(material);
  }
  return presets;
}

Result<Material> MaterialPresets::get(std::string_view name) const {
  const auto it = std::find(names_.begin(), names_.end(), name);
  if (it != names_.end()) return materials_[static_cast<std::size_t>(it - names_.begin())];
  if (const auto meant = guess(name))
    return Error("there is no preset " + in_quotes(name) + "; the preset for it is " +
                 in_quotes(*meant) + ". 'clamor materials' lists all of them.");
  return Error("there is no preset " + in_quotes(name) + "; the nearest name is " +
               in_quotes(nearest_name(name, names_)) + ". 'clamor materials' lists all of them.");
}

std::optional<std::string> MaterialPresets::guess(std::string_view material_name) const {
  const std::vector<std::string> words = words_of(material_name);
  // substance, words, end, characters
  std::tuple<bool, std::size_t, std::size_t, std::size_t> best{};
  std::optional<std::string> result;
  for (const Alias& alias : aliases_)
    for (std::size_t first = 0; first < words.size(); ++first) {
      if (!words_match(alias.words, words, first)) continue;
      std::size_t characters = 0;
      for (const std::string& word : alias.words) characters += word.size();
      const std::tuple rank{alias.substance, alias.words.size(), first + alias.words.size(),
                            characters};
      if (rank > best) {
        best = rank;
        result = names_[alias.preset];
      }
    }
  return result;
}

}  // namespace clamor
