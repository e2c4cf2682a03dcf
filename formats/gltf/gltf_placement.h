// gltf_placement.h: where each node of a glTF scene stands in the world, once per instance.
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
  bool hidden = false;  // by KHR_node_visibility, its own or an ancestor's
  glm::dmat4 world{1.0};
  double delay_s = 0;  // of an instance with an attribute _DELAY_S
};

// Every node that the scene reaches, parents first. Only nodes that carry a mesh or an extension
// are listed. A node reached twice (a cycle, or two parents) is an Error. Uses no recursion, so
// the depth of the hierarchy is bounded by memory alone.
Result<std::vector<PlacedNode>> place_nodes(const GltfScene& scene);

}  // namespace clamor
