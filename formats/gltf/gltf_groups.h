// gltf_groups.h: groups the emitters of a glTF scene by node.
#pragma once

#include <span>

#include "formats/gltf/gltf_scene.h"
#include "formats/level/scene_group.h"

namespace clamor {

// `nodes` contains the node of each emitter in the order of read_scene_sounds(). The hierarchy must
// be a tree, which place_nodes() has checked.
SceneGroups scene_groups(const GltfScene& scene, std::span<const int> nodes);

// Updates the groups after the emitters flagged in `gone` were removed from the list.
void remove_emitters(const std::vector<bool>& gone, SceneGroups& groups);

}  // namespace clamor
