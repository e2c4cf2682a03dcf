// gltf_check.h: reads the lists of a glTF document, and validates them.
//
// Checks types, counts and all indices, so that later stages rely on them.
#pragma once

#include "common/result.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

// Fills in the scene's views, accessors, meshes, nodes and materials from its document. Returns the
// first error.
Result<void> read_gltf_lists(GltfScene& scene);

}  // namespace clamor
