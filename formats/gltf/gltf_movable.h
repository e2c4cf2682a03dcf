// gltf_movable.h: finds the nodes of a glTF scene that are movable parts.
//
// A node is movable if its extras say { "clamor": { "movable": true } }, or if the sidecar lists a
// glob for its name. The meshes of its descendants belong to the part; marks among them have no
// effect.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"
#include "formats/gltf/gltf_marks.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/import_report.h"
#include "formats/level/movable_part.h"

namespace clamor {

struct MovableNodes {
  struct Part {
    int node = kNone;
    glm::dmat4 world{1.0};  // of the node, without scale and shear: its pivot
  };
  std::vector<Part> parts;       // in the order of the scene
  std::vector<int> part_of;      // by node, an index of `parts` or kNone
  std::vector<NodeMarks> marks;  // by node, of those in the scene
};

// The hierarchy must be a tree, which place_nodes() has checked. Warns of globs that match no node.
// Errors: a mark that is neither true nor false; more than kMaxMovableParts; a pivot out of range.
Result<MovableNodes> find_movable_nodes(const GltfScene& scene,
                                        const std::vector<std::string>& globs,
                                        ImportReport& report);

// The parts that have triangles; `meshes` has those of each. Warns of parts without, and of parts
// whose pivot a quantiser has moved.
std::vector<MovablePart> movable_parts(const GltfScene& scene, const MovableNodes& movable,
                                       std::vector<Mesh> meshes, ImportReport& report);

}  // namespace clamor
