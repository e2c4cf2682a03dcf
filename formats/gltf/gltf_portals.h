// gltf_portals.h: reads the portals of a glTF scene.
//
// A node is a portal if its extras say so (gltf_marks.h). Without a mesh it spans a unit square, x
// and y in [-0.5, 0.5] of its own space. With one, the portal is the bounding rectangle of its
// mesh, which must be flat, and whose triangles are no surfaces.
#pragma once

#include <vector>

#include "common/result.h"
#include "formats/gltf/gltf_placement.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/level/sidecar.h"

namespace clamor {

// In the order of the placements: one per instance of a portal. Marks these placements. Errors:
// rectangles without area, and meshes that are not flat.
Result<std::vector<PortalSpec>> read_scene_portals(const GltfScene& scene,
                                                   std::vector<PlacedNode>& placements);

}  // namespace clamor
