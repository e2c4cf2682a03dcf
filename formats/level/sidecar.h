// sidecar.h: LEVEL.acoustics.json, what a level's glTF file does not say. acoustics.schema.json
// documents it.
//
//   { "materials": { "brick*": "brick", "Wall_?": { "absorption": 0.1, "scattering": 0.3 } },
//     "emitters":  [ { "name": "violin", "signal": "violin.flac", "at": [1, 1.2, -3] } ],
//     "settings":  { "photons": 200000, "seed": 1, "air": { "temperature_c": 20 } } }
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/air.h"
#include "common/result.h"
#include "formats/level/acoustic_values.h"
#include "formats/level/emitter_spec.h"

namespace clamor {

// Settings of the bake that a level brings along; the command line wins over them.
struct ImportedSettings {
  std::optional<std::uint64_t> photons, seed;
  std::optional<Air> air;
};

struct Sidecar {
  struct MaterialRule {
    std::string pattern;  // a glob on the material's name
    AcousticMaterial acoustics;
  };
  std::vector<MaterialRule> materials;  // the first that matches counts
  std::vector<EmitterSpec> emitters;
  ImportedSettings settings;
};

// An unknown member is an Error that names the nearest known one.
Result<Sidecar> parse_sidecar(std::string_view text, const MaterialPresets& presets);

}  // namespace clamor
