// gltf_marks.h: what the extras of a node say it is: a probe, a portal, a movable part.
//
// Extras hold "clamor": { "probe": true }, or the flat "clamor_probe": true as Blender exports
// custom properties; likewise "portal" and "movable". Godot exports the metadata entry "extras".
//
// A portal without a mesh spans a unit square, x and y in [-0.5, 0.5] of its own space. With one,
// it is the bounding rectangle of its mesh, which must be flat, and whose triangles are no
// surfaces. The mesh of a probe stays part of the level.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/gltf/gltf_placement.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/level/sidecar.h"

namespace clamor {

struct NodeMarks {
  bool probe = false, portal = false, movable = false;
  bool is_baked_closed = false;  // of a portal: "baked": "both"
  std::string material;          // that it is then closed with
  PartPatterns parts{};          // that open and close it
};

Result<NodeMarks> read_marks(const GltfScene& scene, std::size_t node);

// Portals in the order of the placements, one per instance; `marks` are by node. Marks these
// placements. Errors: rectangles without area, and meshes that are not flat.
Result<std::vector<PortalSpec>> read_scene_portals(const GltfScene& scene,
                                                   std::span<const NodeMarks> marks,
                                                   std::span<PlacedNode> placements);

// World positions of probes, one per instance.
Result<std::vector<Vec3>> read_scene_probes(const GltfScene& scene,
                                            std::span<const NodeMarks> marks,
                                            std::span<const PlacedNode> placements);

// "node 'Door'", for errors.
std::string node_in_words(const GltfScene& scene, std::size_t node);

}  // namespace clamor
