// gltf_mesh_report.h: tells what building the mesh of a glTF scene found, moved and skipped, and
// which nodes its triangles come from.
#pragma once

#include "formats/gltf/gltf_mesh.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/import_report.h"

namespace clamor {

// The nodes of all triangles, in their order.
std::vector<NamedTriangles> named_triangles(const GltfScene& scene, const SceneMesh& mesh);

void report_mesh(const GltfScene& scene, const SceneMesh& mesh, ImportReport& report);

}  // namespace clamor
