// level_materials.h: assigns acoustic values to the materials of a level and reports their origin.
//
// The first of these that applies:
//   1. the first pattern of the sidecar that matches the name; the report says where it replaces
//      values of the level
//   2. extensions.CLAMOR_materials_acoustic of the glTF material
//   3. its extras: "acoustic": { ... } or the name of a preset, or flat "acoustic_preset", ...
//   4. the preset that the name of the material tells, unless it tells two opposite ones
//   5. the default preset, with a warning
// Values of 4 and 5 are opened as far as the material's alpha channel is (material_holes.h).
#pragma once

#include <optional>
#include <string>

#include "common/result.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/import_report.h"
#include "formats/level/sidecar.h"

namespace clamor {

class LevelFolder;
struct Level;

// Fills level.materials with the materials that triangles use, in the order of the glTF file, and
// renumbers the materials of level.mesh and of the movable parts, which are glTF indices before
// (gltf_mesh.h). Reads textures of materials with holes from `folder`.
Result<void> assign_materials(const GltfScene& scene, const Sidecar& sidecar,
                              const std::optional<std::string>& default_preset, LevelFolder& folder,
                              Level& level, ImportReport& report);

}  // namespace clamor
