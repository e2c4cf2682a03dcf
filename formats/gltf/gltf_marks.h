// gltf_marks.h: what the extras of a node say it is: a probe, a portal, a movable part.
//
// Extras hold "clamor": { "probe": true }, or the flat "clamor_probe": true as Blender exports
// custom properties; likewise "portal" and "movable". Godot exports the metadata entry "extras".
#pragma once

#include <string>

#include "common/result.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/level/portal_coupling.h"

namespace clamor {

struct NodeMarks {
  bool probe = false, portal = false, movable = false;
  bool is_baked_closed = false;  // of a portal: "baked": "both"
  std::string material;          // that it is then closed with
  PartPatterns parts{};          // that open and close it
};

Result<NodeMarks> read_marks(const GltfScene& scene, std::size_t node);

// "node 'Door'", for errors.
std::string node_in_words(const GltfScene& scene, std::size_t node);

}  // namespace clamor
