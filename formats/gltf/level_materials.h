// level_materials.h: gives every material of a level its acoustic values, and says from where.
//
// The first of these that has something to say:
//   1. the sidecar's first pattern that matches its name; it is written later than the level, and
//   on
//      purpose, so the report says so where it replaces what the level says
//   2. extensions.CLAMOR_materials_acoustic of the glTF material
//   3. its extras: "acoustic": { ... } or a preset's name, or flat "acoustic_preset", ...
//   4. the preset of which an alias occurs in its name
//   5. the default preset, with a warning
#pragma once

#include <optional>
#include <string>

#include "common/result.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/level_import.h"
#include "formats/level/level.h"
#include "formats/level/sidecar.h"

namespace clamor {

// Fills level.materials with those that triangles use, in the order of the glTF file, renumbers
// level.mesh.materials (glTF's numbers before, see gltf_mesh.h) and reports.
Result<void> assign_materials(const GltfScene& scene, const Sidecar& sidecar,
                              const std::optional<std::string>& default_preset, Level& level,
                              ImportReport& report);

}  // namespace clamor
