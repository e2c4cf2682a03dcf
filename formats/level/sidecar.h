// sidecar.h: parses LEVEL.acoustics.json, the acoustic data beside a glTF file.
// acoustics.schema.json documents it.
//
//   { "materials": { "brick*": "brick", "Wall_?": { "absorption": 0.1, "scattering": 0.3 } },
//     "emitters":  [ { "name": "violin", "signal": "violin.flac", "at": [1, 1.2, -3] } ],
//     "listeners": [ { "name": "row 5", "at": [0, 1.2, 6], "yaw": 0 } ],
//     "probes":    [ { "at": [0, 1.5, 4] } ],
//     "movable":   [ "Door*" ],
//     "ignored":   [ "UCX_*" ],  "kept": [ "Sky_Ceiling" ],
//     "portals":   [ { "name": "Door", "at": [5, 1, 2], "size": [0.9, 2], "facing": [1, 0, 0] } ],
//     "settings":  { "photons": 200000, "seed": 1, "air": { "temperature_c": 20 } } }
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/air.h"
#include "common/result.h"
#include "common/vec.h"
#include "formats/level/acoustic_values.h"
#include "formats/level/emitter_spec.h"
#include "formats/level/portal.h"
#include "formats/level/portal_coupling.h"
#include "formats/level/surface_rules.h"

namespace clamor {

// Bake settings of a level; the command line overrides them.
struct ImportedSettings {
  std::optional<std::uint64_t> photons, seed;
  std::optional<Air> air;
};

// A portal, the preset that it has as a closed surface if it is baked closed, too, and patterns for
// the names of the movable parts that open and close it, if these are given.
struct PortalSpec {
  Portal portal;
  std::string material;
  PartPatterns parts{};
};

// A place to listen from, for tools; the bake does not depend on it.
struct ListenerSpec {
  std::string name;
  Vec3 at_m{};
  double yaw_deg = 0, pitch_deg = 0;  // as --listener takes them
  bool operator==(const ListenerSpec&) const = default;
};

struct Sidecar {
  struct MaterialRule {
    std::string pattern;  // glob for the names of materials
    AcousticMaterial acoustics;
  };
  std::vector<MaterialRule> materials;  // the first match applies
  std::vector<EmitterSpec> emitters;
  std::vector<EmitterChange> emitter_changes;  // entries without a signal
  std::vector<ListenerSpec> listeners;
  std::vector<Vec3> probes_m;        // placed by hand
  std::vector<std::string> movable;  // globs for the names of nodes
  SurfacePatterns surfaces;          // "ignored" and "kept"
  std::vector<PortalSpec> portals;
  ImportedSettings settings;
};

// Unknown members are Errors that suggest the nearest known name.
Result<Sidecar> parse_sidecar(std::string_view text, const MaterialPresets& presets);

// Reads "baked" ("open" or "both") and "material" of a portal: whether it is baked closed, too, and
// as what.
bool read_baked_states(JsonFields& fields, std::string& material);

// Reads "parts" of a portal.
PartPatterns read_portal_parts(JsonFields& fields);

}  // namespace clamor
