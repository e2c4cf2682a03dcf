// gltf_placement.h: world transforms of the nodes of a glTF scene, one per instance.
#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "common/result.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

struct PlacedNode {
  int node = 0;
  std::uint32_t instance = 0;  // 0, 1, ... of a node with EXT_mesh_gpu_instancing
  bool instanced = false;
  glm::dmat4 world{1.0};
  double delay_s = 0;   // attribute _DELAY_S of an instance
  bool portal = false;  // set by read_scene_portals(): its triangles are no surfaces
};

// Lists the reachable nodes that have a mesh, an extension or extras, parents first. A node that is
// reached twice (a cycle or two parents) is an Error. Not recursive, so the depth of the hierarchy
// is limited by memory alone.
Result<std::vector<PlacedNode>> place_nodes(const GltfScene& scene);

}  // namespace clamor
