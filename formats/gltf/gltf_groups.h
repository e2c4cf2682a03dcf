// gltf_groups.h: which emitters of a glTF scene stand under one node.
#pragma once

#include <span>

#include "formats/gltf/gltf_scene.h"
#include "formats/level/scene_group.h"

namespace clamor {

// `nodes`: the node of each emitter, as read_scene_sounds() lists them. The hierarchy is a tree, as
// place_nodes() has checked.
SceneGroups scene_groups(const GltfScene& scene, std::span<const int> nodes);

// Makes the groups those of the list without the emitters that are gone from it.
void remove_emitters(const std::vector<bool>& gone, SceneGroups& groups);

}  // namespace clamor
