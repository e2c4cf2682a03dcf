// sidecar.h: parses LEVEL.acoustics.json, the acoustic data beside a glTF file.
// acoustics.schema.json documents it.
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

// Bake settings of a level; the command line overrides them.
struct ImportedSettings {
  std::optional<std::uint64_t> photons, seed;
  std::optional<Air> air;
};

struct Sidecar {
  struct MaterialRule {
    std::string pattern;  // glob for the names of materials
    AcousticMaterial acoustics;
  };
  std::vector<MaterialRule> materials;  // the first match applies
  std::vector<EmitterSpec> emitters;
  ImportedSettings settings;
};

// Unknown members are Errors that suggest the nearest known name.
Result<Sidecar> parse_sidecar(std::string_view text, const MaterialPresets& presets);

}  // namespace clamor
