// gltf_scenes.h: chooses one of the scenes of a glTF file, and says what the others hold.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/import_report.h"

namespace clamor {

// The index of the scene that `wanted` names by name or number, else of the default scene, else of
// the first; nothing if the file has no scenes. The Error lists the scenes.
Result<std::optional<std::size_t>> choose_scene(const Json& document,
                                                const std::optional<std::string>& wanted);

// The nodes of a scene; without one, all nodes that have no parent.
std::vector<int> scene_roots(const GltfScene& scene, std::optional<std::size_t> index);

// Names the scenes with meshes other than `chosen`, and meshes that are in no scene. Warns if the
// chosen one has no meshes but others do.
void report_other_scenes(const GltfScene& scene, std::optional<std::size_t> chosen,
                         ImportReport& report);

}  // namespace clamor
