#include "formats/gltf/level_materials.h"

#include <algorithm>

#include <fmt/format.h>

#include "common/text.h"
#include "formats/gltf/material_holes.h"
#include "formats/level/level.h"
#include "formats/level/material_presets.h"
#include "formats/level/name_match.h"

namespace clamor {

namespace {

constexpr const char* kUnnamed = "(no material)";

struct Assigned {
  AcousticMaterial acoustics;
  std::string how;
};

bool has_flat_extras(const Json* extras) {
  return extras != nullptr && (extras->find("acoustic_preset") != nullptr ||
                               extras->find("acoustic_absorption") != nullptr);
}

// Step 1: the sidecar.
std::optional<Assigned> from_sidecar(const std::string& name, const Sidecar& sidecar) {
  for (const Sidecar::MaterialRule& rule : sidecar.materials)
    if (glob_matches(rule.pattern, name)) {
      Assigned assigned{rule.acoustics, "sidecar " + in_quotes(rule.pattern)};
      assigned.acoustics.material.name = name;
      return assigned;
    }
  return std::nullopt;
}

// Steps 2 and 3: extension and extras of the glTF material.
Result<std::optional<Assigned>> from_level(const Json* json, const std::string& name,
                                           const MaterialPresets& presets) {
  if (json == nullptr) return std::optional<Assigned>();
  const auto read = [&](const Json& values, const char* how,
                        const char* prefix) -> Result<std::optional<Assigned>> {
    auto acoustics = read_acoustic_material(values, name, presets, prefix);
    if (!acoustics.ok()) return acoustics.error();
    return std::optional(Assigned{std::move(*acoustics), how});
  };
  constexpr const char* kExtension = "CLAMOR_materials_acoustic";
  if (const Json* values = json->find({"extensions", kExtension}))
    return read(*values, kExtension, "");
  if (const Json* values = json->find({"extras", "acoustic"})) return read(*values, "extras", "");
  if (const Json* extras = json->find("extras"); has_flat_extras(extras))
    return read(*extras, "extras", "acoustic_");
  return std::optional<Assigned>();
}

// Steps 4 and 5: alias or default.
Result<Assigned> from_name(const std::string& name, const MaterialPresets& presets,
                           const std::string& default_preset, ImportReport& report) {
  const NameGuess guess = name == kUnnamed ? NameGuess() : presets.guess(name);
  const std::string preset = guess.is_sure() ? guess.preset : default_preset;
  auto material = presets.get(preset);
  if (!material.ok()) return material.error();
  material->name = name;
  if (!guess.doubt.empty())
    report.warnings.push_back(fmt::format(
        "material '{}' may be '{}' or '{}', one of which absorbs what the other reflects; it was "
        "taken for '{}' (give it a preset in the sidecar)",
        name, guess.preset, guess.doubt, preset));
  return Assigned{{std::move(*material), preset},
                  guess.is_sure()       ? "name"
                  : guess.doubt.empty() ? "default"
                                        : "doubt"};
}

// Adds the number of triangles and their area per glTF material; the last entry is for triangles
// without material.
void measure(const Mesh& mesh, std::vector<MaterialAssignment>& result) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& triangle = mesh.triangles[t];
    const Vec3 a(mesh.vertices_m[triangle[0]]), b(mesh.vertices_m[triangle[1]]),
        c(mesh.vertices_m[triangle[2]]);
    MaterialAssignment& measured = result[mesh.materials[t]];
    ++measured.triangles;
    measured.area_m2 += length(cross(b - a, c - a)) / 2;
  }
}

// Limits transmission to absorption: a surface cannot transmit what it reflects. Later stages rely
// on it.
void clamp_transmission(Material& material, ImportReport& report) {
  bool clamped = false;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    clamped |= material.transmission[b] > material.absorption[b];
    material.transmission[b] = std::min(material.transmission[b], material.absorption[b]);
  }
  if (clamped)
    report.warnings.push_back(fmt::format(
        "material '{}' transmits more than it absorbs, where absorption is all that it does not "
        "reflect; its transmission is reduced to its absorption",
        material.name));
}

void warn_of_unused_rules(const Sidecar& sidecar, const GltfScene& scene, ImportReport& report) {
  for (const Sidecar::MaterialRule& rule : sidecar.materials) {
    const auto matches = [&](const std::string& name) { return glob_matches(rule.pattern, name); };
    if (std::any_of(scene.materials.begin(), scene.materials.end(), matches)) continue;
    if (matches(kUnnamed)) continue;
    report.warnings.push_back(
        fmt::format("the sidecar's '{}' matches no material; the nearest is '{}'", rule.pattern,
                    nearest_name(rule.pattern, scene.materials)));
  }
}

}  // namespace

Result<void> assign_materials(const GltfScene& scene, const Sidecar& sidecar,
                              const std::optional<std::string>& default_preset, LevelFolder& folder,
                              Level& level, ImportReport& report) {
  const MaterialPresets& presets = MaterialPresets::built_in();
  const std::string fallback = default_preset.value_or("plaster");
  if (const auto known = presets.get(fallback); !known.ok())
    return known.error().in("default material");

  std::vector<MaterialAssignment> measured(scene.materials.size() + 1);
  measure(level.mesh, measured);
  for (const MovablePart& part : level.movable_parts) measure(part.mesh, measured);
  std::vector<std::uint16_t> renumbered(measured.size(), 0);
  const auto materials = scene.json.list("materials");
  std::size_t defaults = 0;
  for (std::size_t m = 0; m < measured.size(); ++m) {
    if (measured[m].triangles == 0) continue;
    const bool unnamed = m == scene.materials.size() || scene.materials[m].empty();
    const std::string name = unnamed ? kUnnamed : scene.materials[m];
    const Json* json = m < materials.size() ? &materials[m] : nullptr;
    auto written = from_level(json, name, presets);
    if (!written.ok()) return written.error();
    if (auto ruled = from_sidecar(name, sidecar)) {
      if (*written)
        report.found.push_back(fmt::format("material '{}': the {} replaces the level's own {}",
                                           name, ruled->how, (*written)->how));
      *written = std::move(*ruled);
    }
    const bool is_explicit = written->has_value();
    if (!is_explicit) {
      auto guessed = from_name(name, presets, fallback, report);
      if (!guessed.ok()) return guessed.error();
      *written = std::move(*guessed);
    }
    Assigned& assigned = **written;
    if (const auto holes = json == nullptr ? std::nullopt : material_holes(scene, *json, folder))
      apply_holes(*holes, assigned.acoustics.preset, is_explicit, assigned.acoustics.material,
                  report);
    if (assigned.how == "default") ++defaults;
    measured[m].material = name;
    measured[m].preset = assigned.acoustics.preset;
    measured[m].how = assigned.how;
    renumbered[m] = static_cast<std::uint16_t>(level.materials.size());
    level.materials.push_back(std::move(assigned.acoustics.material));
    clamp_transmission(level.materials.back(), report);
    report.materials.push_back(measured[m]);
  }
  for (std::uint16_t& material : level.mesh.materials) material = renumbered[material];
  for (MovablePart& part : level.movable_parts)
    for (std::uint16_t& material : part.mesh.materials) material = renumbered[material];

  warn_of_unused_rules(sidecar, scene, report);
  if (defaults > 0)
    report.warnings.push_back(fmt::format(
        "{} of {} materials have names that say nothing; they were taken for '{}' (give "
        "them presets in the sidecar)",
        defaults, level.materials.size(), fallback));
  return {};
}

}  // namespace clamor
