// gltf_mesh_report.h: tells what building the mesh of a glTF scene found, moved and skipped.
#pragma once

#include "formats/gltf/gltf_mesh.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/import_report.h"

namespace clamor {

void report_mesh(const GltfScene& scene, const SceneMesh& mesh, ImportReport& report);

}  // namespace clamor
