// acoustic_values.h: acoustic values as levels and sidecars give them, made eight bands.
//
// A list is understood by its length: 1 value is for all bands; 3 are Steam Audio's (400, 2500 and
// 15000 Hz); 6 are 125 to 4000 Hz, 7 are 125 to 8000 Hz, 8 are 63 to 8000 Hz, 9 are 31.5 to 8000 Hz
// (Resonance Audio's) and 10 are 31.5 to 16000 Hz, in octaves. Any other needs its own bandsHz.
// Values are linear between the frequencies given and constant beyond them.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "common/bands.h"
#include "common/material.h"
#include "common/result.h"
#include "formats/files/json.h"
#include "formats/level/material_presets.h"

namespace clamor {

// `hz` may be empty. Every value must be from low to high.
Result<Bands> bands_from_values(std::span<const double> values, std::span<const double> hz,
                                double low, double high);

// The member `key` of `fields` as bands, with the frequencies in its member "bandsHz" if that is
// there and its length fits. What is wrong goes to fields.fail().
std::optional<Bands> bands_member(JsonFields& fields, std::string_view key, double low,
                                  double high);

struct AcousticMaterial {
  Material material;
  std::string preset;  // that it began with; empty for none
};

// { "preset": name, "absorption": [...], "scattering": [...], "phong": [...], "transmission":
// [...], "bandsHz": [...] }, all optional but one of preset and absorption; or just the name of a
// preset. Values given beside a preset replace its own. A phong exponent without scattering means
// a surface without scattering (and an exponent of 0 Lambert's law). `prefix` stands before every
// name ("acoustic_" in flat extras); then members without it are somebody else's. `name` is the
// material's.
Result<AcousticMaterial> read_acoustic_material(const Json& json, const std::string& name,
                                                const MaterialPresets& presets,
                                                const std::string& prefix = "");

}  // namespace clamor
