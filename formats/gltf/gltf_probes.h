// gltf_probes.h: reads the hand-placed probes of a glTF scene.
//
// A node is a probe if its extras say so (gltf_marks.h). Its mesh, if it has one, stays part of the
// level.
#pragma once

#include <vector>

#include "common/result.h"
#include "common/vec.h"
#include "formats/gltf/gltf_placement.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

// World positions, in the order of the placements: one per instance of a probe.
Result<std::vector<Vec3>> read_scene_probes(const GltfScene& scene,
                                            const std::vector<PlacedNode>& placements);

}  // namespace clamor
