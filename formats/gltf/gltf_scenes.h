// gltf_scenes.h: chooses one of the scenes of a glTF file, and says what the others hold.
#pragma once

#include <optional>
#include <string>

#include "common/result.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/import_report.h"

namespace clamor {

// Chooses the scene that `wanted` names by name or number, else the default scene, else the first;
// without scenes, all nodes that have no parent are roots. The Error lists the scenes.
Result<void> choose_scene(GltfScene& scene, const std::optional<std::string>& wanted);

// Names the scenes with meshes other than the chosen one, and meshes that are in no scene. Warns if
// the chosen one has no meshes but others do.
void report_other_scenes(const GltfScene& scene, ImportReport& report);

}  // namespace clamor
