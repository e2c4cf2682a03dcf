// gltf_origin.h: chooses the origin of a level (level_origin.h), and makes its nodes relative to
// it.
#pragma once

#include <vector>

#include "formats/gltf/gltf_movable.h"
#include "formats/gltf/gltf_placement.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

// By the median middle of the placed meshes, which single objects far away do not change. Zero
// without meshes. Reads a few vertices of each mesh.
Vec3 origin_of(const GltfScene& scene, const std::vector<PlacedNode>& placements);

// Subtracts the scene's origin from the placements and the pivots.
void subtract_origin(const GltfScene& scene, std::vector<PlacedNode>& placements,
                     MovableNodes& movable);

}  // namespace clamor
