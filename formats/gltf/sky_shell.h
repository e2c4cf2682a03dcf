// sky_shell.h: recognises a sky by its look and shape, where no name tells.
//
// A mesh is a sky if its materials shine by themselves while others are lit, if it is a round shell
// or a box of twice the size of all else, and if everything else lies inside.
#pragma once

#include "formats/gltf/gltf_mesh.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/gltf_surfaces.h"
#include "formats/gltf/import_report.h"

namespace clamor {

// Removes the skies from the mesh and reports them. Takes time only if there are such materials.
void leave_out_sky_shells(const GltfScene& scene, const SceneSurfaces& surfaces, SceneMesh& mesh,
                          ImportReport& report);

}  // namespace clamor
